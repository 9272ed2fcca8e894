//! The keys in Redis.

/// The keys of one installation. They all begin with the same prefix.
#[derive(Debug)]
pub(super) struct Keys {
    prefix: String,
}

impl Keys {
    pub(super) fn new(prefix: String) -> Self {
        Self { prefix }
    }

    /// A stream of all reports, with the camera and the size in bytes of each.
    pub(super) fn reports(&self) -> String {
        format!("{}:reports", self.prefix)
    }

    /// A sorted set of the reports that are not their camera's latest.
    pub(super) fn earlier(&self) -> String {
        format!("{}:earlier", self.prefix)
    }

    /// A sorted set of the cameras by the ID of their latest report.
    pub(super) fn cameras(&self) -> String {
        format!("{}:cameras", self.prefix)
    }

    /// A hash of the newest ID (`last`) and the total size of all reports (`bytes`).
    pub(super) fn totals(&self) -> String {
        format!("{}:totals", self.prefix)
    }

    /// A sorted set of the cameras that have an image, by the ID of its report.
    pub(super) fn pictures(&self) -> String {
        format!("{}:pictures", self.prefix)
    }

    /// A hash of a camera's image: the report's ID (`id`), `frame` and `sketch`.
    pub(super) fn picture(&self, camera: &str) -> String {
        format!("{}{camera}", self.prefix_of_pictures())
    }

    /// The prefix of the keys of all images.
    pub(super) fn prefix_of_pictures(&self) -> String {
        format!("{}:picture:", self.prefix)
    }

    /// The number of the last report that a server has sent.
    pub(super) fn sender(&self, server: &str) -> String {
        format!("{}:sender:{server}", self.prefix)
    }

    /// A stream of a camera's reports.
    pub(super) fn camera(&self, camera: &str) -> String {
        format!("{}{camera}", self.prefix_of_cameras())
    }

    /// The prefix of the keys of all cameras.
    pub(super) fn prefix_of_cameras(&self) -> String {
        format!("{}:camera:", self.prefix)
    }
}
