//! Reading of untrusted ONNX files, with size limits and a check for references to other files
//! before the runtime sees the bytes.
//!
//! An ONNX tensor may keep its values in another file, at a path chosen by the model. The runtime
//! resolves such paths even for models passed as bytes, so the graph is checked here first. The
//! field numbers are those of `onnx.proto`, which are stable.
//!
//! The wire format of protocol buffers, as far as ONNX files need it.
//!
//! Source: "Encoding", protocol buffers documentation.

use std::path::Path;

use lookdown_common::files;

use super::InferenceError;

/// Largest ONNX file, bytes. Protocol buffers are limited to 2 GiB.
const MAX_BYTES: u64 = 1 << 30;
/// Most values of one tensor in a file.
const MAX_VALUES: u64 = 1 << 29;
/// The operator for an execution provider's compiled engine, which is mostly in another file.
const ENGINE: &[u8] = b"EPContext";

/// Reads a whole file.
///
/// # Errors
/// [`InferenceError::Unreadable`]: the error of the operating system, or that the file is too
/// large.
pub(super) fn read(path: &Path) -> Result<Vec<u8>, InferenceError> {
    files::read(path, MAX_BYTES).map_err(|error| InferenceError::Unreadable {
        path: path.to_owned(),
        detail: error.to_string(),
    })
}

/// Checks that the runtime may load this file.
///
/// # Errors
/// One sentence: the bytes are not an ONNX model, refer to other files, or contain an oversized
/// tensor.
pub(super) fn check(bytes: &[u8]) -> Result<(), String> {
    let mut has_graph = false;
    for field in fields(bytes) {
        has_graph |= field.map_err(|()| no_model())?.number == 7;
    }
    if !has_graph {
        return Err(no_model());
    }
    Message::Model.check(bytes, 0)
}

/// The messages of `onnx.proto` on the way to a tensor.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Message {
    Model,
    Training,
    Function,
    Graph,
    Node,
    Attribute,
    SparseTensor,
    Tensor,
}

impl Message {
    /// The message type in a field of this message.
    fn child(self, field: u64) -> Option<Self> {
        match (self, field) {
            (Self::Model, 7) | (Self::Training, 1 | 2) | (Self::Attribute, 6 | 11) => {
                Some(Self::Graph)
            }
            (Self::Model, 20) => Some(Self::Training),
            (Self::Model, 25) => Some(Self::Function),
            (Self::Function, 7) | (Self::Graph, 1) => Some(Self::Node),
            (Self::Function, 11) | (Self::Node, 5) => Some(Self::Attribute),
            (Self::Graph, 5) | (Self::Attribute, 5 | 10) | (Self::SparseTensor, 1 | 2) => {
                Some(Self::Tensor)
            }
            (Self::Graph, 15) | (Self::Attribute, 22 | 23) => Some(Self::SparseTensor),
            _ => None,
        }
    }

    fn check(self, bytes: &[u8], depth: usize) -> Result<(), String> {
        if depth > MAX_DEPTH {
            return Err(format!("its graphs are nested more than {MAX_DEPTH} deep"));
        }
        if self == Self::Tensor {
            return check_tensor(bytes);
        }
        for field in fields(bytes) {
            let Field { number, value } = field.map_err(|()| no_model())?;
            match (self, number, value) {
                (Self::Node, 4, Value::Bytes(ENGINE)) => {
                    return Err("it contains a compiled engine: save the original model".into());
                }
                (_, _, Value::Bytes(bytes)) => {
                    if let Some(child) = self.child(number) {
                        child.check(bytes, depth + 1)?;
                    }
                }
                _ => {}
            }
        }
        Ok(())
    }
}

/// `TensorProto`: 1 `dims`, 13 `external_data`, 14 `data_location` (1 is external).
fn check_tensor(bytes: &[u8]) -> Result<(), String> {
    let mut values: u64 = 1;
    for field in fields(bytes) {
        let Field { number, value } = field.map_err(|()| no_model())?;
        match (number, value) {
            (13, _) | (14, Value::Varint(1..)) => {
                return Err(
                    "it keeps tensors in other files, which is refused: save it as one \
                            file"
                        .to_owned(),
                );
            }
            (1, dimensions) => {
                for dimension in dimensions.varints() {
                    // A negative dimension is decoded as a very large number.
                    let dimension = dimension.map_err(|()| no_model())?;
                    values = values.saturating_mul(dimension.max(1));
                }
            }
            _ => {}
        }
    }
    if values > MAX_VALUES {
        return Err(format!("it has a tensor of more than {MAX_VALUES} values"));
    }
    Ok(())
}

/// Deepest nesting of graphs within graphs.
const MAX_DEPTH: usize = 64;

/// The message about bytes that are not a complete model.
fn no_model() -> String {
    "it is not an ONNX model, or is cut off".to_owned()
}

/// A field of a message.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Field<'a> {
    number: u64,
    value: Value<'a>,
}

/// Value of a field.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Value<'a> {
    Varint(u64),
    /// A string, a message or packed numbers.
    Bytes(&'a [u8]),
    /// A number of four or eight bytes, which is skipped.
    Fixed,
}

impl<'a> Value<'a> {
    /// The numbers of a repeated field, packed or not. Ends with an error where they are cut off.
    fn varints(self) -> impl Iterator<Item = Result<u64, ()>> + use<'a> {
        let (single, mut packed) = match self {
            Self::Varint(number) => (Some(Ok(number)), &[][..]),
            Self::Bytes(bytes) => (None, bytes),
            Self::Fixed => (Some(Err(())), &[][..]),
        };
        let rest = std::iter::from_fn(move || {
            (!packed.is_empty()).then(|| {
                let number = varint(&mut packed).ok_or(());
                if number.is_err() {
                    packed = &[];
                }
                number
            })
        });
        single.into_iter().chain(rest)
    }
}

/// The fields of a message in order. Ends with an error at the first invalid field.
fn fields(mut bytes: &[u8]) -> impl Iterator<Item = Result<Field<'_>, ()>> {
    std::iter::from_fn(move || {
        (!bytes.is_empty()).then(|| {
            let field = field(&mut bytes).ok_or(());
            if field.is_err() {
                bytes = &[];
            }
            field
        })
    })
}

fn field<'a>(bytes: &mut &'a [u8]) -> Option<Field<'a>> {
    let tag = varint(bytes)?;
    let value = match tag & 7 {
        0 => Value::Varint(varint(bytes)?),
        1 => take(bytes, 8).map(|_| Value::Fixed)?,
        2 => {
            let len = usize::try_from(varint(bytes)?).ok()?;
            Value::Bytes(take(bytes, len)?)
        }
        5 => take(bytes, 4).map(|_| Value::Fixed)?,
        _ => return None,
    };
    let number = tag >> 3;
    (number > 0).then_some(Field { number, value })
}

fn take<'a>(bytes: &mut &'a [u8], len: usize) -> Option<&'a [u8]> {
    let (taken, rest) = bytes.split_at_checked(len)?;
    *bytes = rest;
    Some(taken)
}

/// Reads a varint: seven bits per byte, least significant first, at most ten bytes.
fn varint(bytes: &mut &[u8]) -> Option<u64> {
    let mut number = 0;
    for shift in (0..64).step_by(7) {
        let (&byte, rest) = bytes.split_first()?;
        *bytes = rest;
        number |= u64::from(byte & 0x7f) << shift;
        if byte < 0x80 {
            return Some(number);
        }
    }
    None
}

#[cfg(test)]
mod tests;
