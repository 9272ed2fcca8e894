//! The values of a tensor that is read: a part of the JSON, or bytes after it.

use bytes::Bytes;
use serde_json::value::RawValue;

use super::{BINARY_SIZE, HEAD_LENGTH, binary_data, json_data};

/// The values of a tensor as they were sent.
#[derive(Debug)]
pub enum TensorData<'a> {
    /// In the JSON.
    Json(&'a str),
    /// After the JSON.
    Binary(Bytes),
}

impl<'a> TensorData<'a> {
    /// Returns the values of a tensor. With `binary_size`, they are the next bytes of `behind`, the
    /// bytes after the JSON.
    ///
    /// # Errors
    /// The end of a sentence: what was sent, and what is needed.
    pub fn take(
        data: Option<&'a RawValue>,
        binary_size: Option<usize>,
        behind: &mut Bytes,
    ) -> Result<Self, String> {
        match (data, binary_size) {
            (Some(data), None) => Ok(Self::Json(data.get())),
            (None, Some(size)) if size <= behind.len() => Ok(Self::Binary(behind.split_to(size))),
            (None, Some(size)) => {
                let left = behind.len();
                Err(format!(
                    "its {BINARY_SIZE} is {size}, and {left} bytes are left after the JSON, whose \
                     length is said by {HEAD_LENGTH}"
                ))
            }
            (Some(_), Some(_)) => Err(format!(
                "it has data as well as {BINARY_SIZE}: send it once"
            )),
            (None, None) => Err(format!("it has neither data nor {BINARY_SIZE}")),
        }
    }

    /// Returns the largest memory that the elements of a tensor of `BYTES` need besides the
    /// message, in bytes, before they are read.
    pub fn unpacked_bytes(&self) -> usize {
        match self {
            Self::Json(text) => json_data::bytes_at_most(text),
            // The values are a part of the message.
            Self::Binary(_) => 0,
        }
    }

    /// Returns the `count` elements of a tensor of `BYTES`.
    ///
    /// # Errors
    /// The end of a sentence: what was sent, and what is needed.
    pub fn elements(self, count: usize) -> Result<Vec<Bytes>, String> {
        match self {
            Self::Json(text) => json_data::byte_elements(text, count),
            Self::Binary(bytes) => binary_data::elements(&bytes, count),
        }
    }

    /// Returns `count` numbers of `FP32`. As bytes, they may be not finite.
    ///
    /// # Errors
    /// The end of a sentence: what was sent, and what is needed.
    pub fn floats(self, count: usize) -> Result<Vec<f32>, String> {
        match self {
            Self::Json(text) => json_data::floats(text, count),
            Self::Binary(bytes) => binary_data::floats(&bytes, count),
        }
    }
}

/// Returns the number of elements of a shape; `None` if it exceeds the address space.
pub fn element_count(shape: impl IntoIterator<Item = usize>) -> Option<usize> {
    shape.into_iter().try_fold(1_usize, usize::checked_mul)
}
