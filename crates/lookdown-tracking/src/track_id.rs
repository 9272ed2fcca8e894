//! The identity of a track.

use serde::{Deserialize, Serialize};

/// Identifies a track within its tracker, and a later one of the same person who came back.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct TrackId(pub u64);
