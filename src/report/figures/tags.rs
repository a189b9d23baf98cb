//! Data attributes of drawn elements: `<circle data-p="12" …>` is the pose of row 12.

use std::cell::RefCell;

/// Attributes of the last elements of one kind, in the order of drawing.
#[derive(Debug)]
pub struct Tags {
    element: &'static str,
    attributes: RefCell<Vec<String>>,
}

impl Tags {
    /// Creates attributes for dots.
    pub fn of_dots() -> Self {
        Self { element: "<circle", attributes: RefCell::default() }
    }

    /// Creates attributes for boxes.
    pub fn of_boxes() -> Self {
        Self { element: "<rect", attributes: RefCell::default() }
    }

    /// Marks the next dot as the pose of a row, if there is one.
    pub fn pose(&self, row: Option<usize>) {
        self.push(row.map_or_else(String::new, |row| format!(" data-p=\"{row}\"")));
    }

    /// Adds the attributes of the next element.
    pub fn push(&self, attributes: String) {
        self.attributes.borrow_mut().push(attributes);
    }

    /// Returns the drawing with the attributes inserted.
    pub fn insert_into(self, svg: &str) -> String {
        let attributes = self.attributes.into_inner();
        let parts: Vec<&str> = svg.split(self.element).collect();
        let untagged = (parts.len() - 1).saturating_sub(attributes.len());
        let mut text = String::with_capacity(svg.len() + 16 * attributes.len());
        for (k, part) in parts.into_iter().enumerate() {
            if k > 0 {
                text.push_str(self.element);
                let tag = k.checked_sub(untagged + 1).and_then(|tag| attributes.get(tag));
                text.extend(tag.map(String::as_str));
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
            tags.insert_into(svg),
            "<circle cx=\"1\"/><text/><circle data-p=\"7\" cx=\"2\"/><circle cx=\"3\"/>"
        );
    }
}
