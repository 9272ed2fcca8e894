//! Removal of the end of a graph, for exports with a suppression of overlaps inside.
//!
//! The bytes are edited at the level of fields, so that fields of newer versions of `onnx.proto`
//! are kept as they are.

use std::collections::HashSet;

use super::protobuf::{Field, MAX_DEPTH, Value, fields, no_model, push_bytes};

/// A tensor of 32-bit floats with an open shape: field 1 of `TypeProto` with field 1 of `Tensor`.
const FLOAT_TENSOR: &[u8] = &[0x0a, 0x02, 0x08, 0x01];

/// Returns the model with `outputs` as its only outputs, without the nodes, constants and shapes
/// that they do not need.
///
/// # Errors
/// One sentence: the bytes are not an ONNX model, or no node has such an output.
pub(in crate::inference) fn cut(model: &[u8], outputs: &[&str]) -> Result<Vec<u8>, String> {
    let (mut result, mut graphs) = (Vec::with_capacity(model.len()), 0);
    for field in fields(model) {
        match field.map_err(|()| no_model())? {
            Field {
                number: 7,
                value: Value::Bytes(graph),
                ..
            } => {
                graphs += 1;
                push_bytes(&mut result, 7, &cut_graph(graph, outputs)?);
            }
            other => result.extend_from_slice(other.raw),
        }
    }
    if graphs == 1 {
        Ok(result)
    } else {
        Err(no_model())
    }
}

/// `GraphProto`: 1 `node`, 5 `initializer`, 12 `output`, 13 `value_info`.
fn cut_graph(graph: &[u8], outputs: &[&str]) -> Result<Vec<u8>, String> {
    let all: Result<Vec<_>, ()> = fields(graph).collect();
    let all = all.map_err(|()| no_model())?;
    let mut needed: HashSet<&[u8]> = outputs.iter().map(|name| name.as_bytes()).collect();
    let (mut made, mut dropped) = (HashSet::new(), HashSet::new());
    // A node follows the nodes whose outputs it reads.
    for (index, field) in all.iter().enumerate().rev() {
        let (1, Value::Bytes(node)) = (field.number, field.value) else {
            continue;
        };
        let node_outputs = strings(node, 2)?;
        if node_outputs.iter().any(|output| needed.contains(output)) {
            made.extend(node_outputs);
            add_inputs(node, &mut needed, 0)?;
        } else {
            dropped.insert(index);
        }
    }
    if let Some(missing) = outputs.iter().find(|name| !made.contains(name.as_bytes())) {
        return Err(format!(
            "no node of it has the output {missing:?}: correct the manifest's [output], or fetch \
             the file for which it was written"
        ));
    }
    let (mut result, mut shapes) = (Vec::with_capacity(graph.len()), Vec::new());
    for (index, field) in all.iter().enumerate() {
        let Value::Bytes(content) = field.value else {
            result.extend_from_slice(field.raw);
            continue;
        };
        let is_kept = match field.number {
            1 => !dropped.contains(&index),
            5 => strings(content, 8)?
                .iter()
                .all(|name| needed.contains(name)),
            12 => false,
            13 => {
                let names = strings(content, 1)?;
                shapes.extend(names.first().map(|name| (*name, content)));
                let is_output = |name: &&[u8]| outputs.iter().any(|o| o.as_bytes() == *name);
                let is_used = |name: &&[u8]| made.contains(*name) && !is_output(name);
                names.iter().all(is_used)
            }
            _ => true,
        };
        if is_kept {
            result.extend_from_slice(field.raw);
        }
    }
    for name in outputs {
        let known = shapes.iter().find(|(shaped, _)| *shaped == name.as_bytes());
        if let Some((_, content)) = known {
            push_bytes(&mut result, 12, content);
        } else {
            let mut content = Vec::new();
            push_bytes(&mut content, 1, name.as_bytes());
            push_bytes(&mut content, 2, FLOAT_TENSOR);
            push_bytes(&mut result, 12, &content);
        }
    }
    Ok(result)
}

/// Returns the values of a field with strings.
fn strings(message: &[u8], number: u64) -> Result<Vec<&[u8]>, String> {
    let mut found = Vec::new();
    for field in fields(message) {
        match field.map_err(|()| no_model())? {
            field if field.number != number => {}
            Field {
                value: Value::Bytes(text),
                ..
            } => found.push(text),
            _ => return Err(no_model()),
        }
    }
    Ok(found)
}

/// Adds the tensors that a node reads, those of the graphs in its attributes included.
///
/// `NodeProto`: 1 `input`, 5 `attribute`. `AttributeProto`: 6 `g`, 11 `graphs`.
fn add_inputs<'a>(
    node: &'a [u8],
    needed: &mut HashSet<&'a [u8]>,
    depth: usize,
) -> Result<(), String> {
    if depth > MAX_DEPTH {
        return Err(no_model());
    }
    // The name of an input that is left out is empty.
    needed.extend(
        strings(node, 1)?
            .into_iter()
            .filter(|name| !name.is_empty()),
    );
    for attribute in strings(node, 5)? {
        for field in [6, 11] {
            for graph in strings(attribute, field)? {
                // A graph may return a tensor of the graph around it.
                for output in strings(graph, 12)? {
                    needed.extend(strings(output, 1)?);
                }
                for node in strings(graph, 1)? {
                    add_inputs(node, needed, depth + 1)?;
                }
            }
        }
    }
    Ok(())
}
