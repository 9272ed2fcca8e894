//! The keys and channels in Redis. All of an installation share one hash tag, so that a managed
//! endpoint in front of several nodes has them on one, where a script can change all of them.

use crate::results::Cameras;

/// The keys and channels of one installation. They all begin with the same prefix.
#[derive(Debug)]
pub(super) struct Keys {
    /// The hash tag: the prefix in braces.
    tag: String,
    /// The database. Keys belong to a database, channels to all of them.
    database: i64,
}

impl Keys {
    pub(super) fn new(prefix: &str, database: i64) -> Self {
        Self {
            tag: format!("{{{prefix}}}"),
            database,
        }
    }

    /// The keys of forget.lua, in its order.
    pub(super) fn index(&self) -> [String; 5] {
        [
            self.earlier(),
            self.cameras(),
            self.key("latest"),
            self.totals(),
            self.images(),
        ]
    }

    /// A sorted set of the reports that are not their camera's latest: `ID:SIZE:CAMERA`.
    pub(super) fn earlier(&self) -> String {
        self.key("earlier")
    }

    /// A sorted set of the cameras by the ID of their latest report.
    pub(super) fn cameras(&self) -> String {
        self.key("cameras")
    }

    /// A hash of the newest ID (`last`) and the total size of all reports (`bytes`).
    pub(super) fn totals(&self) -> String {
        self.key("totals")
    }

    /// A sorted set of the cameras that have an image, by the ID of its report.
    pub(super) fn images(&self) -> String {
        self.key("images")
    }

    /// A hash of a camera's image: the report's ID (`id`), `frame` and `sketch`.
    pub(super) fn image(&self, camera: &str) -> String {
        self.prefix_of_images() + camera
    }

    /// The prefix of the keys of all images.
    pub(super) fn prefix_of_images(&self) -> String {
        self.key("image:")
    }

    /// A sorted set of the servers by the number of the last report that each sent.
    pub(super) fn senders(&self) -> String {
        self.key("senders")
    }

    /// A stream of a camera's reports.
    pub(super) fn camera(&self, camera: &str) -> String {
        self.prefix_of_cameras() + camera
    }

    /// The prefix of the keys of all cameras.
    pub(super) fn prefix_of_cameras(&self) -> String {
        self.key("camera:")
    }

    /// The channel on which new reports of these cameras are published.
    pub(super) fn channel(&self, cameras: &Cameras) -> String {
        let Self { tag, database } = self;
        match cameras {
            Cameras::All => format!("{tag}:{database}:all"),
            Cameras::One(camera) => format!("{tag}:{database}:camera:{camera}"),
        }
    }

    fn key(&self, name: &str) -> String {
        format!("{}:{name}", self.tag)
    }
}
