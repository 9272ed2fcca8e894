//! One round of looking at a frame: the views of a rig, and what the network found in each.

use std::sync::Arc;

use super::camera_rig::CameraRig;
use crate::{
    geometry::Footprint,
    inference::{Model, ViewDetection},
};

/// One round of looking. All rounds of a frame share its camera.
pub(super) struct Pass {
    /// The views.
    pub(super) rig: Arc<CameraRig>,
    /// Who looked.
    pub(super) model: Arc<Model>,
    /// What was found in each of them.
    pub(super) per_view: Vec<Vec<ViewDetection>>,
}

/// What was found in a view.
#[derive(Clone, Copy)]
pub(super) struct Find<'a> {
    pub(super) look: &'a Pass,
    /// The view's index in its rig.
    pub(super) view: usize,
    /// A number for the view that no view of any round shares.
    pub(super) number: usize,
    pub(super) detection: &'a ViewDetection,
}

/// Everything found in all rounds.
pub(super) fn finds(passes: &[Pass]) -> impl Iterator<Item = Find<'_>> {
    let numbered = passes.iter().scan(0, |before, look| {
        let first = *before;
        *before += look.per_view.len();
        Some((first, look))
    });
    numbered.flat_map(|(first, look)| {
        let views = look.per_view.iter().enumerate();
        views.flat_map(move |(view, found)| {
            found.iter().map(move |detection| Find {
                look,
                view,
                number: first + view,
                detection,
            })
        })
    })
}

/// In how many views of all rounds a person with this footprint is wholly visible.
pub(super) fn views_holding(passes: &[Pass], footprint: &Footprint) -> usize {
    let holding = passes.iter().map(|look| look.rig.views_holding(footprint));
    holding.sum()
}
