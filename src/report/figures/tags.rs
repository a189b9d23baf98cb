//! What elements of a drawing stand for, as data beside them: `<circle data-p="12" …>` is the pose
//! of row 12.

use std::cell::RefCell;

/// Tags of the last elements of one kind, in the order in which they are drawn.
#[derive(Debug)]
pub struct Tags {
    element: &'static str,
    all: RefCell<Vec<String>>,
}

impl Tags {
    /// Of dots.
    pub fn of_dots() -> Self {
        Self { element: "<circle", all: RefCell::default() }
    }

    /// Of boxes.
    pub fn of_boxes() -> Self {
        Self { element: "<rect", all: RefCell::default() }
    }

    /// The next dot is the pose of a row, where it is one.
    pub fn pose(&self, row: Option<usize>) {
        self.own(row.map_or_else(String::new, |row| format!(" data-p=\"{row}\"")));
    }

    /// The next element has these attributes.
    pub fn own(&self, attributes: String) {
        self.all.borrow_mut().push(attributes);
    }

    /// The drawing with them.
    pub fn put(self, svg: &str) -> String {
        let all = self.all.into_inner();
        let parts: Vec<&str> = svg.split(self.element).collect();
        let untagged = (parts.len() - 1).saturating_sub(all.len());
        let mut text = String::with_capacity(svg.len() + 16 * all.len());
        for (k, part) in parts.into_iter().enumerate() {
            if k > 0 {
                text.push_str(self.element);
                text.extend(
                    k.checked_sub(untagged + 1).and_then(|tag| all.get(tag)).map(String::as_str),
                );
            }
            text.push_str(part);
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_elements_are_tagged() {
        let tags = Tags::of_dots();
        tags.pose(Some(7));
        tags.pose(None);
        let svg = "<circle cx=\"1\"/><text/><circle cx=\"2\"/><circle cx=\"3\"/>";
        assert_eq!(
            tags.put(svg),
            "<circle cx=\"1\"/><text/><circle data-p=\"7\" cx=\"2\"/><circle cx=\"3\"/>"
        );
    }
}
