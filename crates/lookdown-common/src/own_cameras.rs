//! Places of cameras: clients choose names, and the number of places is bounded.

use std::{
    collections::BTreeMap,
    sync::{Arc, PoisonError, RwLock},
};

/// The names of the cameras of this process, which always have a place, and whether they are
/// paused. Clones share them.
#[derive(Debug, Clone, Default)]
pub struct OwnCameras(Arc<RwLock<BTreeMap<String, bool>>>);

impl OwnCameras {
    /// Replaces the names; `true` for those that are paused.
    pub fn set(&self, names: BTreeMap<String, bool>) {
        *self.0.write().unwrap_or_else(PoisonError::into_inner) = names;
    }

    /// Returns true for a camera of this process that is paused: its last number is not the present
    /// one.
    pub fn is_paused(&self, name: &str) -> bool {
        let names = self.0.read().unwrap_or_else(PoisonError::into_inner);
        names.get(name).copied().unwrap_or_default()
    }

    /// Returns true for the name of a camera of this process.
    pub fn contains(&self, name: &str) -> bool {
        let names = self.0.read().unwrap_or_else(PoisonError::into_inner);
        names.contains_key(name)
    }

    /// Returns the claim of a camera.
    pub fn claim(&self, name: &str, is_calibrated: bool) -> Claim {
        match is_calibrated {
            _ if self.contains(name) => Claim::Own,
            true => Claim::Calibrated,
            false => Claim::Unknown,
        }
    }
}

/// The claim of a camera to a place, the weakest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Claim {
    /// A name without a calibration.
    Unknown,
    /// A camera with a calibration.
    Calibrated,
    /// A camera of this process: it has a place beyond the limit, too.
    Own,
}

/// A place that is taken.
#[derive(Debug)]
pub struct Place<K, T> {
    /// The camera.
    pub camera: K,
    /// Its claim.
    pub claim: Claim,
    /// The time of its last frame.
    pub last: T,
    /// True if it makes room for a camera with the same claim.
    pub is_silent: bool,
}

/// Returns the camera that makes room for one with the claim `newcomer`: of those with the weakest
/// claim, the one without a frame for longest.
pub fn makes_room<K, T: Ord>(
    newcomer: Claim,
    places: impl IntoIterator<Item = Place<K, T>>,
) -> Option<K> {
    let places = places.into_iter().filter(|place| {
        place.claim < newcomer
            || (place.claim == newcomer && place.is_silent && newcomer != Claim::Own)
    });
    let first = places.min_by(|one, other| (one.claim, &one.last).cmp(&(other.claim, &other.last)));
    first.map(|place| place.camera)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_weakest_and_oldest_claim_makes_room() {
        let own = OwnCameras::default();
        own.set([("hall".to_owned(), false)].into());
        let place = |camera, is_calibrated, last| Place {
            claim: own.claim(camera, is_calibrated),
            camera,
            last,
            is_silent: last < 10,
        };
        let room = |newcomer, cameras: &[(&'static str, bool, u8)]| {
            let places = cameras.iter();
            makes_room(
                newcomer,
                places.map(|(name, is, last)| place(name, *is, *last)),
            )
        };
        let taken = [
            ("hall", false, 0),
            ("gate", true, 1),
            ("x", false, 30),
            ("y", false, 20),
        ];
        assert_eq!(room(Claim::Own, &taken), Some("y"));
        assert_eq!(room(Claim::Calibrated, &taken), Some("y"));
        assert_eq!(room(Claim::Unknown, &taken), None);
        assert_eq!(
            room(Claim::Unknown, &[("x", false, 3), ("y", false, 4)]),
            Some("x")
        );
        assert_eq!(room(Claim::Calibrated, &taken[..2]), Some("gate"));
        assert_eq!(room(Claim::Own, &taken[..1]), None);
    }
}
