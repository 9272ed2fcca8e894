//! The channels whose reports are published here from now on.

use std::collections::HashSet;

use tokio::sync::watch;

use crate::results::Cameras;

/// The followed channels, by their cameras.
#[derive(Debug, Default)]
pub(super) struct Followed(watch::Sender<HashSet<Cameras>>);

impl Followed {
    /// Waits until the reports of these cameras are published here.
    pub(super) async fn contains(&self, cameras: &Cameras) {
        let mut followed = self.0.subscribe();
        // The sender is `self`, so the channel cannot close during the wait.
        let _ = followed.wait_for(|all| all.contains(cameras)).await;
    }

    pub(super) fn insert(&self, cameras: Cameras) {
        self.0.send_modify(|all| {
            all.insert(cameras);
        });
    }

    /// Removes the channels that are not needed, and returns them.
    pub(super) fn remove_unless(&self, is_needed: impl Fn(&Cameras) -> bool) -> Vec<Cameras> {
        let mut removed = Vec::new();
        self.0.send_if_modified(|all| {
            removed.extend(all.extract_if(|cameras| !is_needed(cameras)));
            false
        });
        removed
    }

    pub(super) fn clear(&self) {
        self.0.send_modify(HashSet::clear);
    }
}
