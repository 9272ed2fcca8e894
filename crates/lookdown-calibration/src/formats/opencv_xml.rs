//! The XML form of `OpenCV`'s `FileStorage`, read into the tree that its YAML and JSON forms make.
//!
//! The reader streams: time and memory grow with the number of bytes. Attributes are skipped
//! unread, because their names and namespaces are what makes XML expensive, and `FileStorage` needs
//! none.

use quick_xml::{
    Reader,
    events::{BytesRef, BytesStart, Event},
};
use serde_json::{Map, Number, Value};

/// The root element of `FileStorage`.
const ROOT: &str = "opencv_storage";
/// The name that `FileStorage` gives to the entries of a list.
const LIST_ENTRY: &str = "_";

/// Reads a file into a tree. Refuses one with more levels or elements than given, and one with a
/// document type, whose entities could multiply its size.
pub(super) fn parse(text: &str, max_depth: usize, max_elements: usize) -> Result<Value, String> {
    let mut reader = Reader::from_str(text);
    let mut open: Vec<Element> = Vec::new();
    let mut elements = 0;
    loop {
        let event = reader.read_event();
        let line = || {
            let before = usize::try_from(reader.error_position()).unwrap_or(usize::MAX);
            let before = text.as_bytes().get(..before).unwrap_or(text.as_bytes());
            before.split(|byte| *byte == b'\n').count()
        };
        let event = event.map_err(|_| format!("it is not valid XML at line {}", line()))?;
        let is_whole = matches!(event, Event::Empty(_));
        let closed = match event {
            Event::Start(start) | Event::Empty(start) => {
                elements += 1;
                check_bounds(elements, open.len(), max_depth, max_elements)?;
                let element = Element::begun(&start, open.is_empty())?;
                if !is_whole {
                    open.push(element);
                    continue;
                }
                Some(element)
            }
            Event::End(_) => open.pop(),
            Event::Text(text) => {
                let text = text.decode().map_err(|error| error.to_string())?;
                add_text(&mut open, &text);
                continue;
            }
            Event::CData(text) => {
                let text = text.decode().map_err(|error| error.to_string())?;
                add_text(&mut open, &text);
                continue;
            }
            Event::GeneralRef(reference) => {
                add_text(&mut open, character(&reference)?.encode_utf8(&mut [0; 4]));
                continue;
            }
            Event::DocType(_) => {
                return Err("its XML has a document type; remove the <!DOCTYPE> line".to_owned());
            }
            Event::Eof => return Err("its XML ends before </opencv_storage>".to_owned()),
            Event::Comment(_) | Event::Decl(_) | Event::PI(_) => continue,
        };
        let Some(closed) = closed else { continue };
        match open.last_mut() {
            Some(parent) => parent.add(closed),
            None => return Ok(closed.into_value()),
        }
    }
}

fn check_bounds(
    elements: usize,
    open: usize,
    max_depth: usize,
    max_elements: usize,
) -> Result<(), String> {
    if open >= max_depth {
        return Err("its XML is nested too deeply".to_owned());
    }
    if elements > max_elements {
        return Err(format!(
            "its XML has more than {max_elements} elements, and no calibration needs as many"
        ));
    }
    Ok(())
}

/// An element whose end has not been read yet.
struct Element {
    name: String,
    text: String,
    fields: Map<String, Value>,
    entries: Vec<Value>,
    has_children: bool,
}

impl Element {
    fn begun(start: &BytesStart<'_>, is_root: bool) -> Result<Self, String> {
        let name = String::from_utf8_lossy(start.local_name().as_ref()).into_owned();
        if is_root && name != ROOT {
            return Err(format!(
                "its XML is <{name}>; of XML, OpenCV's <{ROOT}> is read"
            ));
        }
        Ok(Self {
            name,
            text: String::new(),
            fields: Map::new(),
            entries: Vec::new(),
            has_children: false,
        })
    }

    fn add(&mut self, child: Self) {
        self.has_children = true;
        if child.name == LIST_ENTRY {
            self.entries.push(child.into_value());
        } else {
            self.fields.insert(child.name.clone(), child.into_value());
        }
    }

    fn into_value(self) -> Value {
        if !self.has_children {
            scalars(&self.text)
        } else if self.fields.is_empty() {
            Value::Array(self.entries)
        } else {
            Value::Object(self.fields)
        }
    }
}

/// Text beside child elements is layout, so that only the text before the first child counts.
fn add_text(open: &mut [Element], text: &str) {
    if let Some(element) = open.last_mut()
        && !element.has_children
    {
        element.text.push_str(text);
    }
}

/// The character of a reference: a number, or one of the five names that XML predefines.
fn character(reference: &BytesRef<'_>) -> Result<char, String> {
    let number = reference.resolve_char_ref();
    if let Some(character) = number.map_err(|error| error.to_string())? {
        return Ok(character);
    }
    let name = reference.decode().map_err(|error| error.to_string())?;
    match name.as_ref() {
        "lt" => Ok('<'),
        "gt" => Ok('>'),
        "amp" => Ok('&'),
        "apos" => Ok('\''),
        "quot" => Ok('"'),
        other => {
            let name: String = other.chars().take(32).collect();
            Err(format!("its XML refers to an unknown entity &{name};"))
        }
    }
}

/// One number, several numbers, or a text.
fn scalars(text: &str) -> Value {
    let words: Vec<_> = text.split_whitespace().collect();
    let numbers: Option<Vec<_>> = words
        .iter()
        .map(|word| Number::from_f64(word.parse().ok()?).map(Value::Number))
        .collect();
    match numbers {
        Some(numbers) if numbers.len() > 1 => Value::Array(numbers),
        Some(mut numbers) if numbers.len() == 1 => numbers.remove(0),
        _ => Value::String(text.trim().trim_matches('"').to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::Write;

    use super::*;

    const MEBIBYTE: usize = 1 << 20;

    fn parsed(text: &str) -> Result<Value, String> {
        parse(text, 32, 100_000)
    }

    /// A document of about a mebibyte whose middle repeats a piece that depends on its number.
    fn repeated(before: &str, piece: impl Fn(usize) -> String, after: &str) -> String {
        let mut text = before.to_owned();
        for index in 0.. {
            if text.len() >= MEBIBYTE - 100 {
                break;
            }
            text.push_str(&piece(index));
        }
        text + after
    }

    /// Each of these takes minutes to days in a parser that resolves namespaces or compares
    /// attributes.
    #[test]
    fn namespaces_and_attributes_cost_linear_time() {
        let root = "<opencv_storage>";
        let end = "</opencv_storage>";
        let attributes = |index| format!(" a{index}=\"1\"");
        let namespaces = |index| format!(" xmlns:n{index}=\"u\"");
        let mut bounded = String::from("<opencv_storage");
        for index in 0..20_000 {
            let _ = write!(bounded, " xmlns:n{index}=\"u\"");
        }
        let children = |index| format!("<n{index}:a xmlns:m{index}=\"u\"/>");
        for text in [
            repeated("<opencv_storage", attributes, "/>"),
            repeated("<opencv_storage", namespaces, "/>"),
            repeated(&(bounded + ">"), children, end),
            repeated(root, |index| format!("<a{index}>&lt;&#65;</a{index}>"), end),
        ] {
            assert!(parsed(&text).is_ok(), "{}", &text[..80]);
        }
        let nested = repeated("", |index| format!("<a xmlns:n{index}=\"u\">"), "");
        let nested = format!("{root}{nested}");
        assert_eq!(parsed(&nested).unwrap_err(), "its XML is nested too deeply");
    }

    #[test]
    fn references_are_resolved_and_entities_refused() {
        let text = "<opencv_storage><a>&#65;&lt;&quot;b</a></opencv_storage>";
        assert_eq!(parsed(text).unwrap()["a"], "A<\"b");
        let text = "<opencv_storage><a>&lol;</a></opencv_storage>";
        assert!(parsed(text).unwrap_err().contains("unknown entity &lol;"));
        let text = "<!DOCTYPE a [<!ENTITY lol \"lol\">]><opencv_storage/>";
        assert!(parsed(text).unwrap_err().contains("document type"));
    }

    #[test]
    fn malformed_documents_are_refused() {
        for text in [
            "",
            "<",
            "<opencv_storage>",
            "<opencv_storage></a>",
            "<opencv_storage><a></opencv_storage>",
            "<other/>",
        ] {
            assert!(parsed(text).is_err(), "{text:?}");
        }
    }
}
