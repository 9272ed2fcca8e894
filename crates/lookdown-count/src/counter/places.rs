//! The places of cameras: which camera makes room for another.

use std::time::Duration;

use lookdown_common::{Claim, Place, makes_room, text::one_line};

use super::{Counter, LOG_PAUSE, MAX_AHEAD_MS};
use crate::{
    definition::CameraDefinition,
    now::Now,
    scene::Scene,
    sums::{DAY_MS, Owner},
};

impl Counter {
    pub(super) fn claim(&self, camera: &str, definition: &CameraDefinition) -> Claim {
        self.options
            .own
            .claim(camera, definition.geometry.is_some())
    }

    /// Removes the camera with the weakest claim, of a site or of all, for a camera with this
    /// claim. Returns false if none makes room.
    pub(super) fn make_room(&mut self, claim: Claim, site: Option<&Owner>, now: Now) -> bool {
        let longest_gap = Duration::from_millis(self.options.longest_gap_ms.unsigned_abs());
        let is_there = |scene: &&Scene| site.is_none_or(|site| scene.owner == *site);
        let places = self.scenes().filter(is_there).flat_map(|scene| {
            scene.cameras.iter().map(|camera| {
                let last = camera.arrived;
                let age = last.map(|last| now.instant.saturating_duration_since(last));
                Place {
                    camera: (scene.owner.clone(), camera.name.clone()),
                    claim: self.claim(&camera.name, &camera.definition),
                    last,
                    is_silent: age.is_none_or(|age| age > longest_gap),
                }
            })
        });
        let Some((owner, camera)) = makes_room(claim, places) else {
            return false;
        };
        if self.room_log.is_over(LOG_PAUSE, now) {
            let shown = one_line(&camera);
            tracing::warn!(
                "there are too many cameras: {shown} made room for another: raise counts.max_cameras, or see GET /counts for unknown names"
            );
        }
        self.displaced_cameras += 1;
        self.forget(&owner, &camera);
        true
    }

    /// Stops following a camera. Its counts stay in the store.
    fn forget(&mut self, owner: &Owner, camera: &str) {
        self.owners.remove(camera);
        self.rebuild(owner, |cameras| drop(cameras.remove(camera)));
        self.has_news = true;
    }

    /// Returns true for a camera of this process that is paused.
    pub(crate) fn is_paused(&self, camera: &str) -> bool {
        self.options.own.is_paused(camera)
    }

    /// Stops following a camera, and forgets its totals and the sums that are not stored yet unless
    /// its history is kept. Returns false for a camera that is not followed.
    pub(crate) fn remove(&mut self, camera: &str, keeps_history: bool) -> bool {
        self.drops.remove(camera);
        if !keeps_history {
            self.totals.remove(camera);
            self.stored_totals.remove(camera);
            self.sums.remove(camera);
        }
        let owner = self.owners.get(camera).cloned();
        if let Some(owner) = &owner {
            self.forget(owner, camera);
        }
        owner.is_some()
    }

    /// Removes cameras without a report in the day before the newest report, so that others have
    /// their place. A report of the future does not count. Their counts stay in the store.
    pub(crate) fn forget_silent(&mut self, now_ms: i64) {
        let cameras = self.scenes.values().flat_map(|scene| {
            let cameras = scene.cameras.iter();
            cameras.map(|camera| {
                (
                    scene.owner.clone(),
                    camera.name.clone(),
                    camera.presence.last_ms,
                )
            })
        });
        let cameras: Vec<_> = cameras.collect();
        let times = cameras.iter().filter_map(|(.., last_ms)| *last_ms);
        let newest = times.filter(|last| *last <= now_ms + MAX_AHEAD_MS).max();
        for (owner, camera, last_ms) in cameras {
            if newest.is_none_or(|newest| last_ms.is_some_and(|last| newest - last <= DAY_MS)) {
                continue;
            }
            tracing::info!(camera, "no longer followed: it has had no report for a day");
            self.forget(&owner, &camera);
        }
    }
}
