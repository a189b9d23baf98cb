//! Patterns of parameter names.

/// Returns true if `name` matches `pattern`, in which `*` matches any run of characters.
pub(crate) fn matches(pattern: &str, name: &str) -> bool {
    let mut parts = pattern.split('*');
    let Some(mut rest) = parts.next().and_then(|first| name.strip_prefix(first)) else {
        return false;
    };
    let mut parts: Vec<&str> = parts.collect();
    let Some(last) = parts.pop() else { return rest.is_empty() };
    for part in parts {
        let Some(found) = rest.find(part) else { return false };
        rest = rest.get(found + part.len()..).unwrap_or_default();
    }
    rest.ends_with(last)
}

#[cfg(test)]
mod tests {
    use super::matches;

    #[test]
    fn stars_match_any_run() {
        assert!(matches("joint*.alpha", "joint12.alpha"));
        assert!(matches("*", "tool.x"));
        assert!(matches("base[*].r*", "base[A].rx"));
        assert!(matches("A.EI", "A.EI"));
        assert!(!matches("A.EI", "A.EIy"));
        assert!(!matches("joint*.a", "joint1.alpha"));
        assert!(!matches("ab*ba", "aba"));
    }
}
