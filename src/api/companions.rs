//! The cameras and counts of this process, and the counts of another host.

use std::{collections::BTreeMap, sync::Arc};

use axum::Router;
use lookdown_common::{OwnCameras, ServerClient};
use parking_lot::RwLock;
use utoipa::openapi::OpenApi;

use crate::{cameras::Cameras, results::FollowedPersons};

/// Returns metrics in the text format of Prometheus.
type MetricsText = Arc<dyn Fn() -> Vec<u8> + Send + Sync>;
/// Returns the reason why a camera is not counted, or why its counts may be too low.
type CountWarning = Arc<dyn Fn(&str) -> Option<String> + Send + Sync>;

/// The parts of `lookdown run` beside the server, and the counts that a server forwards to. Clones
/// share them.
#[derive(Clone, Default)]
pub struct Companions(Arc<RwLock<Parts>>);

#[derive(Default)]
struct Parts {
    counts: Counts,
    /// Returns the OpenAPI document of the counts.
    counts_document: Option<fn() -> OpenApi>,
    count_warning: Option<CountWarning>,
    cameras: Option<Arc<Cameras>>,
    own_cameras: OwnCameras,
    followed: FollowedPersons,
    metrics: BTreeMap<&'static str, MetricsText>,
}

/// The place of the counts.
#[derive(Clone, Default)]
pub(super) enum Counts {
    /// This server has none.
    #[default]
    None,
    /// They are being started in this process.
    Starting,
    /// The routes of this process.
    Here(Router),
    /// Another host.
    Elsewhere(Arc<ServerClient>),
}

impl Companions {
    /// Declares counts of this process, which are not there yet. `document` returns their OpenAPI
    /// document.
    pub fn expect_counts(&self, document: fn() -> OpenApi) {
        let mut parts = self.0.write();
        (parts.counts, parts.counts_document) = (Counts::Starting, Some(document));
    }

    /// Answers requests to `/counts` and `/sites` with these routes.
    pub fn set_counts(
        &self,
        routes: Router,
        warning: impl Fn(&str) -> Option<String> + Send + Sync + 'static,
    ) {
        let mut parts = self.0.write();
        parts.counts = Counts::Here(routes);
        parts.count_warning = Some(Arc::new(warning));
    }

    /// Returns the reason why a camera is not counted here now, or why its counts may be too low.
    pub(super) fn count_warning(&self, camera: &str) -> Option<String> {
        let warning = self.0.read().count_warning.clone()?;
        warning(camera)
    }

    /// Returns the cameras of this process.
    pub fn own_cameras(&self) -> OwnCameras {
        self.0.read().own_cameras.clone()
    }

    /// Returns the numbers of persons that the counts follow.
    pub fn followed(&self) -> FollowedPersons {
        self.0.read().followed.clone()
    }

    /// Answers requests to `/cameras` with these cameras.
    pub fn set_cameras(&self, cameras: Arc<Cameras>) {
        self.0.write().cameras = Some(cameras);
    }

    pub(super) fn cameras(&self) -> Option<Arc<Cameras>> {
        self.0.read().cameras.clone()
    }

    /// Forwards requests to `/counts` and `/sites`. `document` returns their OpenAPI document.
    pub(crate) fn forward_counts(&self, client: ServerClient, document: fn() -> OpenApi) {
        let mut parts = self.0.write();
        parts.counts = Counts::Elsewhere(Arc::new(client));
        parts.counts_document = Some(document);
    }

    /// Adds metrics to those of the server, or replaces those of the same name.
    pub fn set_metrics(
        &self,
        name: &'static str,
        text: impl Fn() -> Vec<u8> + Send + Sync + 'static,
    ) {
        self.0.write().metrics.insert(name, Arc::new(text));
    }

    pub(super) fn counts(&self) -> Counts {
        self.0.read().counts.clone()
    }

    /// Returns the OpenAPI document of the counts, if `/counts` is answered.
    pub(super) fn counts_document(&self) -> Option<OpenApi> {
        let document = self.0.read().counts_document;
        document.map(|document| document())
    }

    /// Returns true if `/counts` is answered.
    pub(super) fn has_counts(&self) -> bool {
        !matches!(self.0.read().counts, Counts::None)
    }

    /// Appends all metrics.
    pub(super) fn add_metrics(&self, text: &mut String) {
        let metrics: Vec<_> = self.0.read().metrics.values().cloned().collect();
        for metrics in metrics {
            text.push_str(&String::from_utf8_lossy(&metrics()));
        }
    }
}
