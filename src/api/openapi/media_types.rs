//! The order of the media types of a body. Some generators of clients read only the first one.

use indexmap::IndexMap;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use utoipa::openapi::OpenApi;

const FORM: &str = "multipart/form-data";

/// The OpenAPI document as it is published: the form is the first media type of a body.
#[derive(Debug, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Document(Node);

#[derive(Debug, Serialize, Deserialize)]
#[serde(untagged)]
enum Node {
    Object(IndexMap<String, Node>),
    Array(Vec<Node>),
    Scalar(Value),
}

impl Document {
    /// Orders the media types of a document.
    ///
    /// # Errors
    /// A document that is not JSON.
    pub fn from_document(document: &OpenApi) -> serde_json::Result<Self> {
        let mut root: Node = serde_json::from_str(&document.to_json()?)?;
        root.put_forms_first();
        Ok(Self(root))
    }
}

impl Node {
    fn put_forms_first(&mut self) {
        match self {
            Self::Object(fields) => {
                if let Some(index) = fields.get_index_of(FORM) {
                    fields.move_index(index, 0);
                }
                fields.values_mut().for_each(Self::put_forms_first);
            }
            Self::Array(items) => items.iter_mut().for_each(Self::put_forms_first),
            Self::Scalar(_) => {}
        }
    }
}
