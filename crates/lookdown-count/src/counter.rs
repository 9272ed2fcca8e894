//! All cameras and sites, the sums that are not stored yet, and the totals.

mod furniture;
mod places;

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
    time::Duration,
};

use lookdown_common::{Claim, OwnCameras, text::one_line};
use lookdown_tracking::{MAX_CAMERAS, taught::NumberWithBar};

use crate::{
    definition::{CameraDefinition, DefinitionKey},
    drops::{DropReason, Drops},
    now::{LogPause, Now},
    presence::ReportTime,
    report::ReceivedReport,
    scene::{Batch, Scene, SceneState},
    scene_camera::NamedCrossing,
    sums::{Owner, Sums, Totals},
};

/// Times that are this much after the own clock are logged, milliseconds.
pub(crate) const MAX_AHEAD_MS: i64 = 300_000;
/// Pause between two equal log lines.
const LOG_PAUSE: Duration = Duration::from_mins(10);

/// The limits of counting.
#[derive(Debug, Clone, Default)]
pub(crate) struct CountingOptions {
    /// Longest time between two reports of a camera that is known, milliseconds.
    pub(crate) longest_gap_ms: i64,
    /// Most cameras.
    pub(crate) max_cameras: usize,
    /// Time after which people on the floor are an alert, milliseconds; `None` for no alerts.
    pub(crate) floor_alert_after_ms: Option<i64>,
    /// Cameras that have a place beyond the limit, too.
    pub(crate) own: OwnCameras,
}

/// The cameras and sites.
#[derive(Default)]
pub(crate) struct Counter {
    options: CountingOptions,
    scenes: BTreeMap<Owner, Scene>,
    /// The scene of each camera.
    owners: BTreeMap<String, Owner>,
    sums: Sums,
    totals: Totals,
    /// The totals of the last transaction. Only these are shown, so that no count that was shown is
    /// lost with the process.
    pub(crate) stored_totals: Totals,
    /// True if a crossing or an entry is not stored yet.
    pub(crate) is_urgent: bool,
    /// ID of the last report that was accepted or refused.
    pub(crate) last_event: u64,
    /// Number of times that the IDs of the server went back.
    pub(crate) position_resets: u64,
    /// Number of cameras that made room for others.
    pub(crate) displaced_cameras: u64,
    /// The reports that were not counted.
    pub(crate) drops: Drops,
    room_log: LogPause,
    position_log: LogPause,
    tracks_log: LogPause,
    ahead_log: LogPause,
    /// The bars of the server's numbers.
    bars: BTreeMap<String, [u64; 2]>,
    /// Scenes that changed since the last commit, and those that are gone.
    changed: BTreeSet<Owner>,
    /// True if reports arrived since the last commit.
    has_news: bool,
}

/// The outcome of a report.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Accepted {
    /// The report is counted.
    Counted(Vec<NamedCrossing>),
    /// The report is not counted.
    Dropped(DropReason),
}

impl Counter {
    pub(crate) fn new(options: CountingOptions, last_event: u64, totals: Totals) -> Self {
        Self {
            options,
            stored_totals: totals.clone(),
            totals,
            last_event,
            ..Self::default()
        }
    }

    /// Sets the bars of the server's numbers by camera: the true number is in 90 % of them.
    pub(crate) fn set_bars(&mut self, bars: BTreeMap<String, [u64; 2]>) {
        self.bars = bars;
    }

    /// Returns the bar of a number of persons of a camera, widened to the number: the one of the
    /// server, else the default one.
    pub(crate) fn bar(&self, camera: &str, persons: u64) -> [u64; 2] {
        let known = self.bars.get(camera).copied();
        let [low, high] = known.unwrap_or_else(|| {
            let untaught = usize::try_from(persons).unwrap_or(usize::MAX);
            let NumberWithBar { low, high, .. } = NumberWithBar::untaught(untaught);
            [low as u64, high as u64]
        });
        [low.min(persons), high.max(persons)]
    }

    /// Adds a scene of the store.
    pub(crate) fn resume(
        &mut self,
        state: SceneState,
        definition: impl FnMut(DefinitionKey) -> Arc<CameraDefinition>,
    ) {
        let scene = Scene::resumed(state, definition);
        for camera in &scene.cameras {
            self.owners.insert(camera.name.clone(), scene.owner.clone());
        }
        self.scenes.insert(scene.owner.clone(), scene);
    }

    /// Shows the totals of a batch that is stored.
    pub(crate) fn stored(&mut self, batch: &Batch) {
        self.stored_totals.clone_from(&batch.totals);
    }

    pub(crate) fn scenes(&self) -> impl Iterator<Item = &Scene> {
        self.scenes.values()
    }

    /// Returns the scene of a camera.
    pub(crate) fn scene_of(&self, camera: &str) -> Option<&Scene> {
        self.scenes.get(self.owners.get(camera)?)
    }

    /// Returns the time of the last report of each camera, milliseconds since the Unix epoch.
    pub(crate) fn last_reports(&self) -> BTreeMap<String, i64> {
        let cameras = self.scenes().flat_map(|scene| &scene.cameras);
        cameras
            .filter_map(|camera| Some((camera.name.clone(), camera.presence.last_ms?)))
            .collect()
    }

    /// Returns the scene of a site.
    pub(crate) fn site(&self, site: &str) -> Option<&Scene> {
        self.scenes.get(&Owner::Site(site.to_owned()))
    }

    /// Returns the longest time between two reports of a camera that is known, milliseconds.
    pub(crate) fn longest_gap_ms(&self) -> i64 {
        self.options.longest_gap_ms
    }

    /// Returns the time after which people on the floor are an alert; `None` for no alerts.
    pub(crate) fn floor_alert_after_ms(&self) -> Option<i64> {
        self.options.floor_alert_after_ms
    }

    /// Acknowledges a floor alert, which is stored with the next transaction. Returns false for an
    /// unknown alert, and `None` for a camera that is not followed.
    pub(crate) fn acknowledge(&mut self, camera: &str, id: u64) -> Option<bool> {
        let owner = self.owners.get(camera)?.clone();
        let (scene, index) = self.scene_at(&owner, camera).ok()?;
        let is_known = scene.cameras[index].floor.acknowledge(id);
        self.changed.insert(owner);
        (self.has_news, self.is_urgent) = (true, true);
        Some(is_known)
    }

    /// Returns the definition that is in use for a camera.
    pub(crate) fn definition(&self, camera: &str) -> Option<Arc<CameraDefinition>> {
        let (_, camera) = self.scene_of(camera)?.camera(camera)?;
        Some(Arc::clone(&camera.definition))
    }

    /// Counts a report unless it was counted before.
    ///
    /// IDs increase as long as the server's clock is not set back between two of its starts. A
    /// smaller ID that is not a repeated report becomes the new position.
    pub(crate) fn accept(
        &mut self,
        event: u64,
        report: &ReceivedReport,
        definition: &Arc<CameraDefinition>,
        now: Now,
    ) -> Accepted {
        let counted = self.count(event, report, definition, now);
        match &counted {
            Ok(_) => self.drops.end(&report.camera),
            Err(reason) => self
                .drops
                .add(&report.camera, *reason, &self.options.own, now),
        }
        counted.map_or_else(Accepted::Dropped, Accepted::Counted)
    }

    fn count(
        &mut self,
        event: u64,
        report: &ReceivedReport,
        definition: &Arc<CameraDefinition>,
        now: Now,
    ) -> Result<Vec<NamedCrossing>, DropReason> {
        let key = report.key(event);
        let scene = self.scene_of(&report.camera);
        let last = scene.and_then(|scene| scene.camera(&report.camera)?.1.last_report);
        if last == Some(key) {
            return Err(DropReason::Repeated);
        }
        self.warn_of_clock(event, report, now);
        self.advance_to(event, now);
        let owner = self.place(&report.camera, definition, now);
        let owner = owner.ok_or(DropReason::TooManyCameras)?;
        self.changed.insert(owner.clone());
        let is_on_site = definition.site.is_some();
        let time = ReportTime {
            at_ms: report.at_ms(is_on_site),
            longest_gap_ms: self.options.longest_gap_ms,
            floor_alert_after_ms: self.options.floor_alert_after_ms,
            bar: self.bars.get(&report.camera).copied(),
            now: now.instant,
        };
        let (scene, index) = self.scene_at(&owner, &report.camera)?;
        scene.cameras[index].last_report = Some(key);
        if let Some(ahead_ms) = report.clock_difference_ms(is_on_site) {
            scene.cameras[index].warn_of_clock(ahead_ms, now);
        }
        let may_begin_again = std::mem::take(&mut scene.may_begin_again);
        let persons = report.observations(definition);
        let mut sums = Sums::default();
        let mut accepted = scene.accept(index, time, &persons, &mut sums);
        if let Err(refused) = &accepted {
            let is_set_back = scene.cameras[index].is_set_back(now.instant);
            if !may_begin_again && !is_set_back {
                return Err(DropReason::OutOfOrder);
            }
            let camera = report.camera.as_str();
            if self.tracks_log.is_over(LOG_PAUSE, now) {
                let shown = one_line(camera);
                tracing::warn!("tracks of {shown} begin again: a clock was set back: {refused}");
            }
            self.rebuild(&owner, |_| ());
            let (scene, index) = self.scene_at(&owner, camera)?;
            accepted = scene.accept(index, time, &persons, &mut sums);
        }
        let crossings = accepted.map_err(|_| DropReason::OutOfOrder)?;
        let has_entries = sums.zones.values().any(|sum| sum.entries > 0);
        self.is_urgent |= has_entries || !sums.crossings.is_empty();
        self.totals.add(&sums);
        self.sums.add(sums);
        Ok(crossings)
    }

    /// Makes the report of this ID the position. A smaller ID than before means that the server has
    /// started with another clock: its reports may have earlier times.
    fn advance_to(&mut self, event: u64, now: Now) {
        self.has_news = true;
        let last = std::mem::replace(&mut self.last_event, event);
        if event >= last {
            return;
        }
        self.position_resets += 1;
        let seconds = (last - event) / 1_000_000;
        if self.position_log.is_over(LOG_PAUSE, now) {
            tracing::warn!(
                "the IDs of the server went back by {seconds} s: counting continues with the new \
                 ones; set the clock of the server"
            );
        }
        for scene in self.scenes.values_mut() {
            scene.may_begin_again = true;
        }
    }

    /// Logs once that reports are dated after the own clock.
    fn warn_of_clock(&mut self, event: u64, report: &ReceivedReport, now: Now) {
        let stored_ms = i64::try_from(event / 1000).unwrap_or(i64::MAX);
        let ahead_ms = stored_ms
            .max(report.at_ms(true))
            .saturating_sub(now.unix_ms);
        if ahead_ms > MAX_AHEAD_MS && self.ahead_log.is_over(LOG_PAUSE, now) {
            let seconds = ahead_ms / 1000;
            tracing::warn!(
                "the reports of the server are dated {seconds} s after the own clock: set both clocks"
            );
        }
    }

    fn scene_at(&mut self, owner: &Owner, camera: &str) -> Result<(&mut Scene, usize), DropReason> {
        let scene = self.scenes.get_mut(owner);
        let scene = scene.ok_or(DropReason::TooManyCameras)?;
        let found = scene.camera(camera).map(|(index, _)| index);
        let index = found.ok_or(DropReason::TooManyCameras)?;
        Ok((scene, index))
    }

    /// Returns the scene of a camera with this definition. Creates or changes it first.
    fn place(
        &mut self,
        camera: &str,
        definition: &Arc<CameraDefinition>,
        now: Now,
    ) -> Option<Owner> {
        let owner = match &definition.site {
            Some(site) => Owner::Site(site.clone()),
            None => Owner::Camera(camera.to_owned()),
        };
        let before = self.owners.get(camera).cloned();
        if before.as_ref() == Some(&owner)
            && let Some(scene) = self.scenes.get_mut(&owner)
            && let Some((index, known)) = scene.camera(camera)
        {
            if known.definition.key == definition.key {
                return Some(owner);
            }
            if known.definition.pose == definition.pose {
                scene.redefine(index, Arc::clone(definition));
                return Some(owner);
            }
        }
        let claim = self.claim(camera, definition);
        let is_full = before.is_none() && self.owners.len() >= self.options.max_cameras;
        if is_full && !self.make_room(claim, None, now) && claim != Claim::Own {
            return None;
        }
        let is_full = |site: &Scene| site.cameras.len() >= MAX_CAMERAS;
        if self.scenes.get(&owner).is_some_and(is_full) && !self.make_room(claim, Some(&owner), now)
        {
            return None;
        }
        let furniture = self.furniture_for(camera, definition);
        if let Some(before) = before {
            self.rebuild(&before, |cameras| drop(cameras.remove(camera)));
        }
        self.rebuild(&owner, |cameras| {
            cameras.insert(camera.to_owned(), Arc::clone(definition));
        });
        self.owners.insert(camera.to_owned(), owner.clone());
        self.restore_furniture(camera, furniture);
        Some(owner)
    }

    /// Creates a scene again with other cameras. Its tracks end.
    fn rebuild(
        &mut self,
        owner: &Owner,
        change: impl FnOnce(&mut BTreeMap<String, Arc<CameraDefinition>>),
    ) {
        let before = self.scenes.remove(owner);
        let cameras = before.as_ref().map(Scene::definitions);
        let mut cameras = cameras.unwrap_or_default();
        change(&mut cameras);
        self.changed.insert(owner.clone());
        if cameras.is_empty() {
            return;
        }
        let cameras = cameras.into_iter().collect();
        match Scene::new(owner.clone(), cameras) {
            Ok(mut scene) => {
                if let Some(before) = before {
                    scene.continue_from(&before);
                }
                self.scenes.insert(owner.clone(), scene);
            }
            Err(problem) => tracing::warn!("{owner} is not followed: {problem}"),
        }
    }

    /// Takes what is to be stored; `None` without news.
    pub(crate) fn take_batch(&mut self) -> Option<Batch> {
        if !std::mem::take(&mut self.has_news) {
            return None;
        }
        self.is_urgent = false;
        let changed = std::mem::take(&mut self.changed).into_iter();
        let scenes = changed.map(|owner| {
            let state = self.scenes.get(&owner).map(Scene::state);
            (owner, state)
        });
        Some(Batch {
            last_event: self.last_event,
            totals: self.totals.clone(),
            scenes: scenes.collect(),
            sums: std::mem::take(&mut self.sums),
        })
    }
}

#[cfg(test)]
mod tests;
