//! The published file of a model that Lookdown does not ship.

use serde::{Deserialize, Deserializer, de::Error};
use url::Url;

/// The table `[upstream]`: the file that the authors of a network publish, and its conversion to
/// the installed file.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Upstream {
    /// Address of the file, `https://`. It ends with a file name.
    #[serde(deserialize_with = "https")]
    pub url: Url,
    /// SHA-256 of the published ONNX file, hexadecimal. In an archive, that of the member.
    #[serde(default)]
    pub sha256: Option<String>,
    /// File name of the ONNX file in the ZIP archive at `url`. Without it, `url` is the ONNX file.
    #[serde(default)]
    pub member: Option<String>,
    /// Removes what follows the outputs of `[output]` from the graph.
    #[serde(default)]
    pub cut: bool,
}

impl Upstream {
    /// Returns the file name at the end of the address.
    #[must_use]
    pub fn file_name(&self) -> &str {
        let path = self.url.path();
        path.rsplit_once('/').map_or(path, |(_, name)| name)
    }
}

fn https<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Url, D::Error> {
    let text = String::deserialize(deserializer)?;
    let url = text.parse::<Url>().ok();
    url.filter(|url| url.scheme() == "https" && !url.path().ends_with('/'))
        .ok_or_else(|| {
            D::Error::custom(format!(
                "url is {text:?}: use an address with https:// that ends with a file name"
            ))
        })
}
