//! The ID of an image in its annotations.

use std::fmt;

use serde::{Deserialize, Serialize};

/// The ID of an image in its data set. In JSON it is a number or a string, as in the annotations.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(untagged)]
pub enum ImageId {
    /// A number, as in COCO.
    Number(u64),
    /// A string, as in CEPDOF. Images without an ID have their path in the data set.
    Text(String),
}

impl fmt::Display for ImageId {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => number.fmt(formatter),
            Self::Text(text) => text.fmt(formatter),
        }
    }
}
