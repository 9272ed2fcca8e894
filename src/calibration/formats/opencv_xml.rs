//! The XML form of `OpenCV`'s `FileStorage`, as the same tree that its YAML and JSON forms make.

use roxmltree::{Document, Node, ParsingOptions};
use serde_json::{Map, Number, Value};

/// Reads a file into a tree; refuses deeper or larger ones than given.
pub(super) fn parse(text: &str, max_depth: usize, max_nodes: usize) -> Result<Value, String> {
    let options = ParsingOptions {
        nodes_limit: u32::try_from(max_nodes).unwrap_or(u32::MAX),
        ..ParsingOptions::default()
    };
    let document =
        Document::parse_with_options(text, options).map_err(|error| error.to_string())?;
    let root = document.root_element();
    if root.tag_name().name() != "opencv_storage" {
        return Err(format!(
            "its XML is <{}>; of XML, OpenCV's <opencv_storage> is read",
            root.tag_name().name()
        ));
    }
    value(root, max_depth)
}

fn value(node: Node<'_, '_>, depth_left: usize) -> Result<Value, String> {
    if depth_left == 0 {
        return Err("its XML is nested too deeply".to_owned());
    }
    let elements: Vec<_> = node.children().filter(Node::is_element).collect();
    if elements.is_empty() {
        return Ok(scalars(node.text().unwrap_or_default()));
    }
    let mut fields = Map::new();
    let mut items = Vec::new();
    for element in elements {
        let content = value(element, depth_left - 1)?;
        match element.tag_name().name() {
            // FileStorage names the entries of a list so.
            "_" => items.push(content),
            name => {
                fields.insert(name.to_owned(), content);
            }
        }
    }
    Ok(if fields.is_empty() {
        Value::Array(items)
    } else {
        Value::Object(fields)
    })
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
