//! Reader of source files and of the paths they use, token by token.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use proc_macro2::{Delimiter, TokenStream, TokenTree};

/// Source file: path below `src`, text, and used paths.
pub struct Source {
    pub path: PathBuf,
    pub text: String,
    /// Module path, for example `["mechanics", "beam"]`; empty for lib.rs.
    pub module: Vec<String>,
    /// Paths from the crate root that the file uses, with their lines, without re-exports.
    pub uses: Vec<(usize, Vec<String>)>,
    /// Re-exported names (`pub use`) with the paths they stand for.
    pub passed_on: BTreeMap<String, Vec<String>>,
    /// Modules declared in separate files.
    pub children: Vec<String>,
}

/// Path as written, with the name it is imported under.
struct Import {
    line: usize,
    path: Vec<String>,
    name: String,
    is_public: bool,
}

impl Source {
    pub fn new(path: &str, text: &str) -> Self {
        let path = PathBuf::from(path);
        let mut module: Vec<String> = path
            .with_extension("")
            .iter()
            .map(|part| part.to_string_lossy().into_owned())
            .collect();
        if module.last().is_some_and(|last| last == "mod" || last == "lib") {
            module.pop();
        }
        let tokens: TokenStream = text.parse().expect("Rust");
        let mut reader = Reader {
            module: &module,
            imports: Vec::new(),
            children: Vec::new(),
            paths: Vec::new(),
        };
        reader.read(tokens);
        let Reader { imports, children, paths, .. } = reader;
        let mut known: BTreeMap<String, Vec<String>> = children
            .iter()
            .map(|child| (child.clone(), [module.clone(), vec![child.clone()]].concat()))
            .collect();
        known.extend(imports.iter().map(|import| (import.name.clone(), import.path.clone())));
        let (mut uses, mut passed_on) = (Vec::new(), BTreeMap::new());
        for import in imports {
            let head = import.path.first().and_then(|first| known.get(first).cloned());
            // A child module is named without its parents.
            let is_child = head
                .as_ref()
                .is_some_and(|head| head.len() == module.len() + 1 && head.starts_with(&module));
            let path = match head {
                Some(head) if is_child => [head, import.path[1..].to_vec()].concat(),
                _ => import.path,
            };
            if import.is_public {
                passed_on.insert(import.name, path);
            } else {
                uses.push((import.line, path));
            }
        }
        for (line, path) in paths {
            let Some(head) = known.get(&path[0]) else {
                if path[0] == "crate" {
                    uses.push((line, path[1..].to_vec()));
                }
                continue;
            };
            uses.push((line, [head.clone(), path[1..].to_vec()].concat()));
        }
        Self { path, text: text.to_owned(), module, uses, passed_on, children }
    }

    /// Returns the top-level module of the file.
    pub fn room(&self) -> &str {
        match self.path.iter().next().and_then(|first| first.to_str()) {
            Some("lib.rs") | None => "lib",
            Some(first) => first.trim_end_matches(".rs"),
        }
    }

    /// Returns the lines without comments, counted from 1. A text that contains // is cut there.
    pub fn code(&self) -> impl Iterator<Item = (usize, &str)> {
        self.text
            .lines()
            .enumerate()
            .map(|(k, line)| (k + 1, line.split("//").next().unwrap_or_default()))
    }

    pub fn at(&self, line: usize, what: &str) -> String {
        format!("src/{}:{line}: {what}", self.path.display())
    }
}

/// Reader of the names in one file.
struct Reader<'a> {
    module: &'a [String],
    imports: Vec<Import>,
    children: Vec<String>,
    /// Paths in the code, with the first segment as written or `crate`.
    paths: Vec<(usize, Vec<String>)>,
}

impl Reader<'_> {
    fn read(&mut self, tokens: TokenStream) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let word = |k: usize| match tokens.get(k) {
            Some(TokenTree::Ident(ident)) => Some(ident.to_string()),
            _ => None,
        };
        let is = |k: usize, c: char| matches!(tokens.get(k), Some(TokenTree::Punct(punct)) if punct.as_char() == c);
        let (mut k, mut is_public) = (0, false);
        while k < tokens.len() {
            match (&tokens[k], word(k).as_deref()) {
                (_, Some("pub")) => {
                    is_public = true;
                    k += 1 + usize::from(matches!(tokens.get(k + 1), Some(TokenTree::Group(_))));
                    continue;
                }
                (_, Some("use")) => {
                    let end = (k..tokens.len()).find(|&k| is(k, ';')).unwrap_or(tokens.len());
                    self.tree(&tokens[k + 1..end], &[], is_public);
                    k = end;
                }
                (_, Some("mod")) => {
                    // Test modules in the file are not checked.
                    if is(k + 2, ';') {
                        self.children.extend(word(k + 1));
                    }
                    k += 2;
                }
                (_, Some(first))
                    if is(k + 1, ':') && is(k + 2, ':') && !(k > 0 && is(k - 1, ':')) =>
                {
                    let line = tokens[k].span().start().line;
                    let mut path = vec![first.to_owned()];
                    while let (true, true, Some(next)) =
                        (is(k + 1, ':'), is(k + 2, ':'), word(k + 3))
                    {
                        path.push(next);
                        k += 3;
                    }
                    self.paths.push((line, self.absolute(path)));
                }
                (TokenTree::Group(group), _) => self.read(group.stream()),
                _ => {}
            }
            is_public = false;
            k += 1;
        }
    }

    /// Reads one tree of a `use` declaration.
    fn tree(&mut self, tokens: &[TokenTree], before: &[String], is_public: bool) {
        let mut path = before.to_vec();
        let line = tokens.first().map_or(0, |token| token.span().start().line);
        let mut words = tokens
            .iter()
            .filter(|token| !matches!(token, TokenTree::Punct(punct) if punct.as_char() == ':'));
        let mut name = None;
        while let Some(token) = words.next() {
            match token {
                TokenTree::Ident(ident) if ident == "as" => {
                    name = words.next().map(ToString::to_string);
                }
                TokenTree::Ident(ident) if ident == "self" && !path.is_empty() => {}
                TokenTree::Ident(ident) => path.push(ident.to_string()),
                TokenTree::Group(group) if group.delimiter() == Delimiter::Brace => {
                    let inner: Vec<TokenTree> = group.stream().into_iter().collect();
                    let is_comma = |token: &TokenTree| matches!(token, TokenTree::Punct(punct) if punct.as_char() == ',');
                    inner
                        .split(is_comma)
                        .filter(|one| !one.is_empty())
                        .for_each(|one| self.tree(one, &path, is_public));
                    return;
                }
                _ => {}
            }
        }
        let path = self.absolute(path);
        let path = if path[0] == "crate" { path[1..].to_vec() } else { path };
        let name = name.or_else(|| path.last().cloned()).unwrap_or_default();
        self.imports.push(Import { line, path, name, is_public });
    }

    /// Resolves `super` and `self` from the crate root; for the command line the library counts as
    /// the crate.
    fn absolute(&self, path: Vec<String>) -> Vec<String> {
        let ups = path.iter().take_while(|word| *word == "super").count();
        let root = || vec!["crate".to_owned()];
        match path[0].as_str() {
            "flexcal" => [root(), path[1..].to_vec()].concat(),
            "self" if path.len() > 1 => [root(), self.module.to_vec(), path[1..].to_vec()].concat(),
            "super" => {
                let kept = self.module.len().saturating_sub(ups);
                [root(), self.module[..kept].to_vec(), path[ups..].to_vec()].concat()
            }
            _ => path,
        }
    }
}

/// Returns every file below `src`.
pub fn sources() -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let (mut folders, mut sources) = (vec![root.clone()], Vec::new());
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let text = fs::read_to_string(&path).unwrap();
                sources
                    .push(Source::new(&path.strip_prefix(&root).unwrap().to_string_lossy(), &text));
            }
        }
    }
    sources.sort_by(|a, b| a.path.cmp(&b.path));
    sources
}
