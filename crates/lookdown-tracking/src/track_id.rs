//! The identity of a track.

use serde::{Deserialize, Serialize};

/// Identifies a track within its tracker; never used twice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct TrackId(pub u64);
