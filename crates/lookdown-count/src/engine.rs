//! All cameras and sites, the sums that are not stored yet, and the totals.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
};

use crate::{
    definition::{CameraDefinition, DefinitionKey},
    report::Report,
    scene::{NamedCrossing, Scene, SceneState},
    sums::{DAY_MS, LineDirection, Owner, Sums, ZoneOf},
    tracking::MAX_CAMERAS,
};

/// The limits of counting.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CountingOptions {
    /// Longest time between two reports of a camera that is known, milliseconds.
    pub(crate) longest_gap_ms: i64,
    /// Most cameras.
    pub(crate) max_cameras: usize,
}

/// The cameras and sites.
pub(crate) struct Engine {
    options: CountingOptions,
    scenes: BTreeMap<Owner, Scene>,
    /// The scene of each camera.
    owners: BTreeMap<String, Owner>,
    sums: Sums,
    totals: Totals,
    /// The totals of the last transaction. Only these are shown, so that no count that was shown is
    /// lost with the process.
    stored_totals: Totals,
    /// True if a crossing or an entry is not stored yet.
    is_urgent: bool,
    /// ID of the last report that the sums contain.
    last_event: u64,
    /// Scenes that changed since the last commit, and those that are gone.
    changed: BTreeSet<Owner>,
    /// True if reports arrived since the last commit.
    has_news: bool,
}

/// Counts since the store was created.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Totals {
    pub(crate) crossings: BTreeMap<LineDirection, u64>,
    pub(crate) zones: BTreeMap<ZoneOf, ZoneTotal>,
}

/// The counts of a zone since the store was created.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct ZoneTotal {
    pub(crate) entries: u64,
    /// Time that persons spent in the zone, milliseconds.
    pub(crate) person_ms: u64,
}

/// The content of the next transaction of the store.
pub(crate) struct Batch {
    pub(crate) last_event: u64,
    /// The totals with these sums.
    pub(crate) totals: Totals,
    pub(crate) sums: Sums,
    /// Changed scenes; `None` for those that are gone.
    pub(crate) scenes: Vec<(Owner, Option<SceneState>)>,
}

/// The outcome of a report.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Accepted {
    /// The report is counted.
    Counted(Vec<NamedCrossing>),
    /// The report was counted before.
    Repeated,
    /// The report came too late or too early for its camera.
    OutOfOrder(String),
    /// The report is of a camera beyond the limit.
    TooManyCameras,
}

impl Engine {
    pub(crate) fn new(options: CountingOptions, last_event: u64, totals: Totals) -> Self {
        Self {
            options,
            scenes: BTreeMap::new(),
            owners: BTreeMap::new(),
            sums: Sums::default(),
            stored_totals: totals.clone(),
            totals,
            is_urgent: false,
            last_event,
            changed: BTreeSet::new(),
            has_news: false,
        }
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

    /// Returns the ID of the last report that was accepted.
    pub(crate) fn last_event(&self) -> u64 {
        self.last_event
    }

    /// Returns the totals that are stored.
    pub(crate) fn totals(&self) -> &Totals {
        &self.stored_totals
    }

    /// Returns true if a crossing or an entry waits for a transaction.
    pub(crate) fn is_urgent(&self) -> bool {
        self.is_urgent
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
            .filter_map(|camera| Some((camera.name.clone(), camera.presence().last_ms?)))
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

    /// Returns the definition that is in use for a camera.
    pub(crate) fn definition(&self, camera: &str) -> Option<Arc<CameraDefinition>> {
        let (_, camera) = self.scene_of(camera)?.camera(camera)?;
        Some(Arc::clone(&camera.definition))
    }

    /// Counts a report. Reports are counted once, in the order of their IDs.
    pub(crate) fn accept(
        &mut self,
        event: u64,
        report: &Report,
        definition: &Arc<CameraDefinition>,
    ) -> Accepted {
        if event <= self.last_event {
            return Accepted::Repeated;
        }
        self.last_event = event;
        self.has_news = true;
        let Some(owner) = self.place(&report.camera, definition) else {
            return Accepted::TooManyCameras;
        };
        let Some(scene) = self.scenes.get_mut(&owner) else {
            return Accepted::TooManyCameras;
        };
        let Some((index, _)) = scene.camera(&report.camera) else {
            return Accepted::TooManyCameras;
        };
        let time = (report.at_ms(), self.options.longest_gap_ms);
        let persons = report.observations(definition);
        let mut sums = Sums::default();
        let accepted = scene.accept(index, time, &persons, &mut sums);
        self.changed.insert(owner);
        match accepted {
            Ok(crossings) => {
                let has_entries = sums.zones.values().any(|sum| sum.entries > 0);
                self.is_urgent |= has_entries || !sums.crossings.is_empty();
                self.totals.add(&sums);
                self.sums.add(sums);
                Accepted::Counted(crossings)
            }
            Err(refused) => Accepted::OutOfOrder(refused.to_string()),
        }
    }

    /// Returns the scene of a camera with this definition. Creates or changes it first.
    fn place(&mut self, camera: &str, definition: &Arc<CameraDefinition>) -> Option<Owner> {
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
                scene.cameras[index].redefine(Arc::clone(definition));
                return Some(owner);
            }
        }
        let is_full = before.is_none() && self.owners.len() >= self.options.max_cameras;
        let site = self.scenes.get(&owner);
        if is_full || site.is_some_and(|site| site.cameras.len() >= MAX_CAMERAS) {
            return None;
        }
        if let Some(before) = before {
            self.rebuild(&before, |cameras| drop(cameras.remove(camera)));
        }
        self.rebuild(&owner, |cameras| {
            cameras.insert(camera.to_owned(), Arc::clone(definition));
        });
        self.owners.insert(camera.to_owned(), owner.clone());
        Some(owner)
    }

    /// Removes cameras without a report in the day before the newest report, so that others have
    /// their place. Their counts stay in the store.
    pub(crate) fn forget_silent(&mut self) {
        let cameras = self.scenes.values().flat_map(|scene| {
            let cameras = scene.cameras.iter();
            cameras.map(|camera| {
                (
                    scene.owner.clone(),
                    camera.name.clone(),
                    camera.presence().last_ms,
                )
            })
        });
        let cameras: Vec<_> = cameras.collect();
        let newest = cameras.iter().filter_map(|(.., last_ms)| *last_ms).max();
        for (owner, camera, last_ms) in cameras {
            if newest.is_none_or(|newest| last_ms.is_some_and(|last| newest - last <= DAY_MS)) {
                continue;
            }
            tracing::info!(camera, "no longer followed: it has had no report for a day");
            self.owners.remove(&camera);
            self.rebuild(&owner, |cameras| drop(cameras.remove(&camera)));
            self.has_news = true;
        }
    }

    /// Creates a scene again with other cameras. Its tracks end.
    fn rebuild(
        &mut self,
        owner: &Owner,
        change: impl FnOnce(&mut BTreeMap<String, Arc<CameraDefinition>>),
    ) {
        let before = self.scenes.remove(owner);
        let mut cameras = before.map(|scene| scene.definitions()).unwrap_or_default();
        change(&mut cameras);
        self.changed.insert(owner.clone());
        if cameras.is_empty() {
            return;
        }
        let cameras = cameras.into_iter().collect();
        match Scene::new(owner.clone(), cameras) {
            Ok(scene) => drop(self.scenes.insert(owner.clone(), scene)),
            Err(problem) => tracing::warn!("{owner:?} is not followed: {problem}"),
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

impl Batch {
    /// Returns a batch without news.
    pub(crate) fn empty(last_event: u64, totals: Totals) -> Self {
        Self {
            last_event,
            totals,
            sums: Sums::default(),
            scenes: Vec::new(),
        }
    }
}

impl Totals {
    /// Adds sums.
    fn add(&mut self, sums: &Sums) {
        for ((of, _), crossings) in &sums.crossings {
            *self.crossings.entry(of.clone()).or_default() += crossings;
        }
        for ((of, _), sum) in &sums.zones {
            let total = self.zones.entry(of.clone()).or_default();
            total.entries += sum.entries;
            total.person_ms += sum.person_ms;
        }
    }
}

impl Sums {
    /// Adds other sums.
    pub(crate) fn add(&mut self, other: Self) {
        for (key, sum) in other.presence {
            let own = self.presence.entry(key).or_default();
            own.known_ms += sum.known_ms;
            own.person_ms += sum.person_ms;
            own.most = own.most.max(sum.most);
        }
        for (key, crossings) in other.crossings {
            *self.crossings.entry(key).or_default() += crossings;
        }
        for (key, sum) in other.zones {
            let own = self.zones.entry(key).or_default();
            own.entries += sum.entries;
            own.visits += sum.visits;
            own.visit_ms += sum.visit_ms;
            own.person_ms += sum.person_ms;
            own.most = own.most.max(sum.most);
        }
        for (key, milliseconds) in other.cells {
            *self.cells.entry(key).or_default() += milliseconds;
        }
    }
}
