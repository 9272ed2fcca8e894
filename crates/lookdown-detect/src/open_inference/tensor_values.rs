//! The values of a tensor that is written: in the JSON, or as bytes after it.

use std::num::TryFromIntError;

use serde::Serialize;

use super::{
    Datatype,
    binary_data::{LENGTH_BYTES, put_element},
};

/// The values of a tensor, row-major.
#[derive(Debug, Clone, Serialize)]
#[serde(untagged)]
pub enum TensorValues<'a> {
    /// `FP32`.
    Floats(&'a [f32]),
    /// `INT32`.
    Integers(&'a [i32]),
    /// The elements of a `BYTES` tensor.
    Texts(Vec<&'a str>),
}

impl TensorValues<'_> {
    /// Returns the datatype.
    pub fn datatype(&self) -> Datatype {
        match self {
            Self::Floats(_) => Datatype::Fp32,
            Self::Integers(_) => Datatype::Int32,
            Self::Texts(_) => Datatype::Bytes,
        }
    }

    /// Returns the number of bytes of the values as bytes.
    pub fn byte_count(&self) -> usize {
        match self {
            Self::Floats(values) => size_of_val(*values),
            Self::Integers(values) => size_of_val(*values),
            Self::Texts(texts) => texts.iter().map(|text| LENGTH_BYTES + text.len()).sum(),
        }
    }

    /// Appends the values as bytes.
    ///
    /// # Errors
    /// Returns an error if the length of an element exceeds four bytes.
    pub fn put_bytes(&self, bytes: &mut Vec<u8>) -> Result<(), TryFromIntError> {
        match self {
            Self::Floats(values) => {
                bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
            }
            Self::Integers(values) => {
                bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
            }
            Self::Texts(texts) => {
                for text in texts {
                    put_element(text.as_bytes(), bytes)?;
                }
            }
        }
        Ok(())
    }
}
