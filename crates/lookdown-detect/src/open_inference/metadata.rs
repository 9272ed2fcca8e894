//! Metadata and health of the server and its models.

use serde::{Deserialize, Deserializer, Serialize};
use utoipa::ToSchema;

/// The metadata of the server.
#[derive(Debug, Serialize, Deserialize, ToSchema)]
pub struct ServerMetadata {
    /// Always `lookdown`.
    #[serde(default, deserialize_with = "null_as_default")]
    #[schema(required)]
    pub name: String,
    /// The version of the server.
    #[serde(default, deserialize_with = "null_as_default")]
    #[schema(required)]
    pub version: String,
    /// The supported extensions of the protocol.
    #[serde(default, deserialize_with = "null_as_default")]
    #[schema(required)]
    pub extensions: Vec<String>,
    /// The default of the parameter `follow`: true if the persons of a camera are followed between
    /// searches of the whole frame. A camera of `watch` or `run` has its own setting.
    #[serde(default)]
    #[schema(required)]
    pub follow: bool,
}

/// The liveness of the server.
#[derive(Debug, Serialize, ToSchema)]
pub struct ServerLive {
    /// Always true.
    pub live: bool,
}

/// The readiness of the server.
#[derive(Debug, Serialize, ToSchema)]
pub struct ServerReady {
    /// Always true; the response is a problem otherwise.
    pub ready: bool,
}

/// The readiness of a model.
#[derive(Debug, Serialize, ToSchema)]
pub struct ModelReady {
    /// The name.
    pub name: String,
    /// Always true; the response is a problem otherwise.
    pub ready: bool,
}

// Other servers omit some members, or send `null`.
/// The metadata of a model.
#[derive(Debug, Serialize, Deserialize, ToSchema)]
pub struct ModelMetadata {
    /// The name.
    #[serde(default, deserialize_with = "null_as_default")]
    #[schema(required)]
    pub name: String,
    /// The only version.
    #[serde(default, deserialize_with = "null_as_default")]
    #[schema(required)]
    pub versions: Vec<String>,
    /// Always `lookdown`.
    #[serde(default, deserialize_with = "null_as_default")]
    #[schema(required)]
    pub platform: String,
    /// The inputs.
    #[serde(default, deserialize_with = "null_as_default")]
    #[schema(required)]
    pub inputs: Vec<TensorMetadata>,
    /// The outputs.
    #[serde(default, deserialize_with = "null_as_default")]
    #[schema(required)]
    pub outputs: Vec<TensorMetadata>,
}

/// The metadata of a tensor.
#[derive(Debug, Serialize, Deserialize, ToSchema)]
pub struct TensorMetadata {
    /// The name.
    pub name: String,
    /// The datatype.
    #[schema(example = "FP32")]
    pub datatype: String,
    /// The shape; -1 for an axis of variable size.
    pub shape: Vec<i64>,
}

/// Reads a value; `null` is the default.
fn null_as_default<'de, D, T>(deserializer: D) -> Result<T, D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de> + Default,
{
    Option::deserialize(deserializer).map(Option::unwrap_or_default)
}
