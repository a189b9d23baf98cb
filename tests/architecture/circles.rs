//! Detection of circular use between files.

use std::collections::BTreeMap;

use super::source::Source;

/// Returns the file in which a path ends; re-exports by `pub use` are followed to the definition.
fn target(
    sources: &[Source],
    of_module: &BTreeMap<&[String], usize>,
    path: &[String],
) -> Option<usize> {
    let mut path = path.to_vec();
    for _ in 0..8 {
        let length =
            (0..=path.len()).rev().find(|&length| of_module.contains_key(&path[..length]))?;
        let file = of_module[&path[..length]];
        match path.get(length).and_then(|name| sources[file].passed_on.get(name)) {
            Some(onward) => path = [onward.clone(), path[length + 1..].to_vec()].concat(),
            None => return Some(file),
        }
    }
    None
}

/// Returns the groups of files that use each other in a circle, each once; `main.rs` and `lib.rs`
/// are exempt.
pub fn circles(sources: &[Source]) -> Vec<String> {
    let named = |source: &Source| !["lib", "main"].contains(&source.room());
    let of_module: BTreeMap<&[String], usize> = sources
        .iter()
        .enumerate()
        .filter(|(_, s)| named(s))
        .map(|(k, s)| (s.module.as_slice(), k))
        .collect();
    let uses: Vec<Vec<usize>> = sources
        .iter()
        .enumerate()
        .map(|(k, source)| {
            let mut all: Vec<usize> = source
                .uses
                .iter()
                .filter_map(|(_, path)| target(sources, &of_module, path))
                .collect();
            all.sort_unstable();
            all.dedup();
            all.retain(|&used| used != k && named(source));
            all
        })
        .collect();
    let reached: Vec<Vec<bool>> = (0..sources.len()).map(|from| reached(&uses, from)).collect();
    let mut told = vec![false; sources.len()];
    let mut circles = Vec::new();
    for one in 0..sources.len() {
        if told[one] || !reached[one][one] {
            continue;
        }
        let circle: Vec<usize> =
            (0..sources.len()).filter(|&k| reached[one][k] && reached[k][one]).collect();
        let arrows = circle.iter().flat_map(|&k| {
            let (uses, circle) = (&uses, &circle);
            let inner = uses[k].iter().filter(move |used| circle.contains(used));
            inner.map(move |&used| {
                format!("{} uses {}", sources[k].path.display(), sources[used].path.display())
            })
        });
        circles.push(arrows.collect::<Vec<_>>().join("\n  "));
        for &k in &circle {
            told[k] = true;
        }
    }
    circles
}

fn reached(uses: &[Vec<usize>], from: usize) -> Vec<bool> {
    let (mut reached, mut open) = (vec![false; uses.len()], uses[from].clone());
    while let Some(next) = open.pop() {
        if !reached[next] {
            reached[next] = true;
            open.extend(&uses[next]);
        }
    }
    reached
}
