//! XML as a tree: enough for model descriptions and system structures.

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

/// Deepest nesting that is read.
const MAX_DEPTH: usize = 64;

/// Why a text is not read.
#[derive(Debug, thiserror::Error)]
pub enum XmlError {
    /// Not well-formed
    #[error("not well-formed XML at byte {at}: {cause}")]
    Syntax {
        /// Where
        at: u64,
        /// What the parser says
        cause: String,
    },
    /// Nested too deeply
    #[error("elements are nested deeper than {MAX_DEPTH}")]
    TooDeep,
    /// No root element, or an open one at the end
    #[error("the text ends inside an element, or has none")]
    Incomplete,
}

/// An element; prefixes of namespaces are left out.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Element {
    /// Local name
    pub name: String,
    attributes: Vec<(String, String)>,
    /// Elements inside, in order
    pub children: Vec<Element>,
}

impl Element {
    /// Value of an attribute.
    #[must_use]
    pub fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(key, _)| key == name).map(|(_, value)| value.as_str())
    }

    /// First element of a name.
    #[must_use]
    pub fn child(&self, name: &str) -> Option<&Self> {
        self.children.iter().find(|child| child.name == name)
    }

    /// All elements of a name.
    pub fn all<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a Self> {
        self.children.iter().filter(move |child| child.name == name)
    }

    /// Elements below `child`, nothing where it is missing.
    #[must_use]
    pub fn inside(&self, child: &str) -> &[Self] {
        self.child(child).map_or(&[], |child| &child.children)
    }
}

/// Reads a document.
///
/// # Errors
/// A text that is not well-formed. Entities other than the five of XML are not expanded.
pub fn parse(text: &[u8]) -> Result<Element, XmlError> {
    let mut reader = Reader::from_reader(text);
    let mut open: Vec<Element> = Vec::new();
    loop {
        let at = reader.buffer_position();
        let syntax = |cause: String| XmlError::Syntax { at, cause };
        match reader.read_event().map_err(|e| syntax(e.to_string()))? {
            Event::Start(start) => {
                if open.len() >= MAX_DEPTH {
                    return Err(XmlError::TooDeep);
                }
                open.push(element(&start).map_err(syntax)?);
            }
            Event::Empty(start) => {
                let element = element(&start).map_err(syntax)?;
                match open.last_mut() {
                    Some(parent) => parent.children.push(element),
                    None => return Ok(element),
                }
            }
            Event::End(_) => {
                let Some(element) = open.pop() else {
                    return Err(XmlError::Incomplete);
                };
                match open.last_mut() {
                    Some(parent) => parent.children.push(element),
                    None => return Ok(element),
                }
            }
            Event::Eof => return Err(XmlError::Incomplete),
            _ => {}
        }
    }
}

fn element(start: &BytesStart<'_>) -> Result<Element, String> {
    let attributes = start.attributes().map(|attribute| {
        let attribute = attribute.map_err(|e| e.to_string())?;
        let value = quick_xml::escape::unescape(&attribute.value).map_err(|e| e.to_string())?.into_owned();
        Ok((attribute.key.local_name().as_ref().to_owned(), value))
    });
    Ok(Element {
        name: start.local_name().as_ref().to_owned(),
        attributes: attributes.collect::<Result<_, String>>()?,
        children: Vec::new(),
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    #[test]
    fn prefixes_are_dropped_and_entities_expanded() {
        let root =
            parse(br#"<?xml version="1.0"?><a:r x="1 &lt; 2"><b:c/><b:c y="&#65;"/><d/></a:r>"#).unwrap();
        assert_eq!(root.name, "r");
        assert_eq!(root.attribute("x"), Some("1 < 2"));
        assert_eq!(root.all("c").count(), 2);
        assert_eq!(root.children[1].attribute("y"), Some("A"));
        assert!(root.child("e").is_none() && root.inside("d").is_empty());
    }

    #[test]
    fn broken_texts_are_refused() {
        for text in ["", "<a>", "<a></b>", "<a x=1/>", "<a x=\"&unknown;\"/>", "</a>"] {
            assert!(parse(text.as_bytes()).is_err(), "{text}");
        }
        assert!(matches!(parse("<a>".repeat(100).as_bytes()), Err(XmlError::TooDeep)));
    }
}
