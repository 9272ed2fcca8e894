//! A tracker with its cameras, one or all of a site, whose lines and zones count its tracks.

use std::{collections::BTreeMap, sync::Arc};

use lookdown_tracking::{
    Observation, RefusedReport, SiteError, Track, Tracker, TrackerSettings, furniture::Furniture,
    heat_map::HeatMap,
};
use serde::{Deserialize, Serialize};

use crate::{
    definition::{CameraDefinition, DefinitionKey},
    presence::{Presence, ReportTime},
    scene_camera::{CameraState, NamedCrossing, SceneCamera},
    sums::{DAY_MS, Owner, Sums, Totals},
};

/// A tracker, the counters of its cameras, and the state of their sums.
pub(crate) struct Scene {
    pub(crate) owner: Owner,
    tracker: Tracker,
    heat_map: HeatMap,
    presence: Presence,
    pub(crate) cameras: Vec<SceneCamera>,
    /// True from a reset of the position until the next report: the server's clock may have been
    /// set back.
    pub(crate) may_begin_again: bool,
}

/// The state of a scene as it is stored.
#[derive(Serialize, Deserialize)]
pub(crate) struct SceneState {
    owner: Owner,
    tracker: Tracker,
    heat_map: HeatMap,
    presence: Presence,
    cameras: Vec<CameraState>,
}

impl SceneState {
    /// Returns the ID of the last report of a camera, if it is in the scene.
    pub(crate) fn last_event_of(&self, camera: &str) -> Option<u64> {
        let mut cameras = self.cameras.iter();
        cameras.find_map(|state| state.last_event_of(camera))
    }
}

impl Scene {
    /// Creates a scene of these cameras without tracks.
    pub(crate) fn new(
        owner: Owner,
        cameras: Vec<(String, Arc<CameraDefinition>)>,
    ) -> Result<Self, SiteError> {
        let poses: Vec<_> = cameras.iter().map(|(_, camera)| camera.pose).collect();
        let mut tracker = Tracker::new(&poses, TrackerSettings::default())?;
        for (index, (_, camera)) in cameras.iter().enumerate() {
            tracker.limit(index, camera.areas.clone());
        }
        let cameras = cameras.into_iter();
        Ok(Self {
            tracker,
            owner,
            heat_map: HeatMap::default(),
            presence: Presence::default(),
            cameras: cameras
                .map(|(name, definition)| SceneCamera::new(&name, definition))
                .collect(),
            may_begin_again: false,
        })
    }

    /// Creates the scene of a stored state. `definition` returns the definition of a key.
    pub(crate) fn resumed(
        state: SceneState,
        mut definition: impl FnMut(DefinitionKey) -> Arc<CameraDefinition>,
    ) -> Self {
        let cameras = state.cameras.into_iter().map(|camera| {
            let definition = definition(camera.key.clone());
            SceneCamera::resumed(camera, definition)
        });
        let cameras: Vec<_> = cameras.collect();
        let mut tracker = state.tracker;
        for (index, camera) in cameras.iter().enumerate() {
            tracker.limit(index, camera.definition.areas.clone());
        }
        Self {
            cameras,
            owner: state.owner,
            tracker,
            heat_map: state.heat_map,
            presence: state.presence,
            may_begin_again: false,
        }
    }

    /// Changes what is counted of a camera. Visits and approaches begin again.
    pub(crate) fn redefine(&mut self, camera: usize, definition: Arc<CameraDefinition>) {
        self.tracker.limit(camera, definition.areas.clone());
        let before = &self.cameras[camera].definition;
        if !before.has_frames_of(&definition)
            && let Some(furniture) = self.tracker.furniture_mut(camera)
        {
            *furniture = Furniture::default();
        }
        self.cameras[camera].redefine(definition);
    }

    /// Takes the furniture and the last reports of another scene's cameras.
    pub(crate) fn continue_from(&mut self, other: &Self) {
        for (index, camera) in self.cameras.iter_mut().enumerate() {
            let Some((known, before)) = other.camera(&camera.name) else {
                continue;
            };
            camera.last_report = before.last_report;
            camera.floor = before.floor.clone();
            let is_same = before.definition.has_frames_of(&camera.definition);
            let kept = other.tracker.furniture(known).filter(|_| is_same);
            if let (Some(kept), Some(own)) = (kept, self.tracker.furniture_mut(index)) {
                own.clone_from(kept);
            }
        }
    }

    /// Returns the furniture of a camera.
    pub(crate) fn furniture(&self, camera: &str) -> Option<&Furniture> {
        self.tracker.furniture(self.camera(camera)?.0)
    }

    /// Returns the furniture of a camera to change it.
    pub(crate) fn furniture_mut(&mut self, camera: &str) -> Option<&mut Furniture> {
        let (index, _) = self.camera(camera)?;
        self.tracker.furniture_mut(index)
    }

    /// Returns the state to be stored.
    pub(crate) fn state(&self) -> SceneState {
        let cameras = self.cameras.iter().map(SceneCamera::state);
        SceneState {
            owner: self.owner.clone(),
            tracker: self.tracker.clone(),
            heat_map: self.heat_map.clone(),
            presence: self.presence,
            cameras: cameras.collect(),
        }
    }

    /// Takes the persons of a report, and adds to the sums. Returns the crossings.
    pub(crate) fn accept(
        &mut self,
        camera: usize,
        time: ReportTime,
        persons: &[Observation],
        sums: &mut Sums,
    ) -> Result<Vec<NamedCrossing>, RefusedReport> {
        let elapsed_s = self.cameras[camera].elapsed_s(time.now);
        self.tracker
            .update(elapsed_s, camera, seconds(time.at_ms), persons)?;
        let tracks: Vec<&Track> = self.tracker.tracks().collect();
        let mut crossings = Vec::new();
        // A line at the edge of an area counts those who cross it from the margin.
        let counted = tracks.iter().copied().filter(|track| track.counts());
        let counted: Vec<&Track> = counted.collect();
        for camera in &mut self.cameras {
            crossings.extend(camera.count([&tracks, &counted], sums));
        }
        let tracks = counted;
        self.heat_map.update(tracks.iter().copied());
        let day = time.at_ms.div_euclid(DAY_MS);
        for (cell, milliseconds) in self.heat_map.take() {
            let key = (self.owner.clone(), day, cell);
            *sums.cells.entry(key).or_default() += milliseconds;
        }
        if let Some(after_ms) = time.floor_alert_after_ms {
            let shown = |track: &&&Track| {
                track.last_person.camera == camera && track.seen_s >= seconds(time.at_ms)
            };
            let shown: Vec<&Track> = tracks.iter().filter(shown).copied().collect();
            let SceneCamera {
                floor, definition, ..
            } = &mut self.cameras[camera];
            floor.update(&shown, time.at_ms, after_ms, definition);
        }
        let tracked = tracks.len() as u64;
        let is_site = matches!(self.owner, Owner::Site(_));
        let reporting = &mut self.cameras[camera];
        reporting.late_since = None;
        reporting.advance_zones(time, sums);
        reporting.advance_rate(time, sums);
        let own = if is_site {
            let own = tracks
                .iter()
                .filter(|track| track.last_person.camera == camera);
            own.count() as u64
        } else {
            tracked
        };
        let owner = Owner::Camera(reporting.name.clone());
        reporting.presence.advance(&owner, time, own, sums);
        if is_site {
            // No server knows the bar of a site.
            let time = ReportTime { bar: None, ..time };
            self.presence.advance(&self.owner, time, tracked, sums);
        }
        Ok(crossings)
    }

    /// Returns the tracks that count.
    pub(crate) fn tracks(&self) -> impl Iterator<Item = &Track> {
        self.tracker.tracks().filter(|track| track.counts())
    }

    /// Returns the persons of the site at its last report.
    pub(crate) fn presence(&self) -> &Presence {
        match self.owner {
            Owner::Site(_) => &self.presence,
            Owner::Camera(_) => &self.cameras[0].presence,
        }
    }

    /// Returns a camera and its index.
    pub(crate) fn camera(&self, name: &str) -> Option<(usize, &SceneCamera)> {
        let mut cameras = self.cameras.iter().enumerate();
        cameras.find(|(_, camera)| camera.name == name)
    }

    pub(crate) fn definitions(&self) -> BTreeMap<String, Arc<CameraDefinition>> {
        let cameras = self.cameras.iter();
        cameras
            .map(|camera| (camera.name.clone(), Arc::clone(&camera.definition)))
            .collect()
    }
}

/// Returns seconds of milliseconds.
pub(crate) fn seconds(milliseconds: i64) -> f64 {
    milliseconds as f64 / 1000.0
}

/// The content of the next transaction of the store.
#[derive(Default)]
pub(crate) struct Batch {
    pub(crate) last_event: u64,
    /// The totals with these sums.
    pub(crate) totals: Totals,
    pub(crate) sums: Sums,
    /// Changed scenes; `None` for those that are gone.
    pub(crate) scenes: Vec<(Owner, Option<SceneState>)>,
}

#[cfg(test)]
mod tests;
