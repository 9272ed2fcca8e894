//! What annotations call a picture.

use std::fmt;

use serde::{Deserialize, Serialize};

/// The ID of a picture in its data set; in JSON a number or a text, as the annotations have it.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(untagged)]
pub enum ImageId {
    /// A number, as in COCO.
    Number(u64),
    /// A text, as in CEPDOF; of pictures without an ID their path in the data set.
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
