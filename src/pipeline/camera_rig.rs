//! Camera rigs: a camera's geometry with the views of a plan and their remap tables, immutable
//! and shared by every frame of that camera.

use std::ops::Range;

use rayon::prelude::*;

use crate::{
    calibration::CameraGeometry,
    detection::{BBox, ViewPixels},
    geometry::{
        BackProjection, Footprint, ViewPlan, VirtualView,
        pixels::{PixelConvention, cross_half_pixel},
    },
    imaging::{Frame, Letterbox, NetworkInput, RemapTable, ViewBatch},
};

/// Every so many outline points decide whether a view holds a whole person.
const OUTLINE_STRIDE: usize = 4;

/// A camera ready for frames of one size.
#[derive(Debug)]
pub(super) struct CameraRig {
    geometry: CameraGeometry,
    looks: Looks,
}

/// How the frame reaches the network.
#[derive(Debug)]
enum Looks {
    /// Through virtual views.
    Views(Vec<(VirtualView, RemapTable)>),
    /// As it is.
    Direct(Letterbox),
}

impl CameraRig {
    /// Tabulates the views of `plan` (without one, the frame is seen as it is). Views that see
    /// nothing of the lens image are left out.
    pub(super) fn new(
        geometry: CameraGeometry,
        frame_width: u32,
        frame_height: u32,
        plan: Option<&ViewPlan>,
        input: &NetworkInput,
    ) -> Self {
        let looks = match plan {
            None => Looks::Direct(Letterbox::new(frame_width, frame_height, input)),
            Some(plan) => {
                let views = plan.views(&geometry.mount, input.width, input.height);
                let tabulated = views.into_par_iter().map(|view| {
                    let table = RemapTable::new(&view, &geometry.lens, frame_width, frame_height);
                    (view, table)
                });
                Looks::Views(
                    tabulated
                        .filter(|(_, table)| table.inside_share() > 0.0)
                        .collect(),
                )
            }
        };
        Self { geometry, looks }
    }

    /// Lens and mount.
    pub(super) fn geometry(&self) -> &CameraGeometry {
        &self.geometry
    }

    /// How many views the network has to see.
    pub(super) fn view_count(&self) -> usize {
        match &self.looks {
            Looks::Views(views) => views.len(),
            Looks::Direct(_) => 1,
        }
    }

    /// Memory held by the tables, bytes.
    pub(super) fn bytes(&self) -> usize {
        match &self.looks {
            Looks::Views(views) => views.iter().map(|(_, table)| table.bytes()).sum(),
            Looks::Direct(_) => 0,
        }
    }

    /// Renders some views into `batch`, several at a time.
    pub(super) fn render(
        &self,
        frame: &Frame,
        range: Range<usize>,
        input: &NetworkInput,
        batch: &mut ViewBatch,
    ) {
        let slots = batch.prepare(range.len(), input);
        match &self.looks {
            Looks::Direct(letterbox) => {
                for slot in slots {
                    letterbox.render(frame, input, slot);
                }
            }
            Looks::Views(views) => {
                let jobs: Vec<_> = views[range].iter().zip(slots).collect();
                jobs.into_par_iter()
                    .for_each(|((_, table), slot)| table.render(frame, input, slot));
            }
        }
    }

    /// What a box found in a view covers in the frame; `None` beyond the lens image.
    pub(super) fn footprint(
        &self,
        view: usize,
        bbox: &BBox<ViewPixels>,
        back_projection: BackProjection,
    ) -> Option<Footprint> {
        match &self.looks {
            Looks::Views(views) => Footprint::of_view_box(
                bbox.corners(),
                back_projection,
                &views[view].0,
                &self.geometry.lens,
                &self.geometry.mount,
            ),
            Looks::Direct(letterbox) => Some(Footprint::of_frame_box(
                bbox.corners().map(|side| letterbox.frame_from_input(side)),
            )),
        }
    }

    /// In how many views a person with this footprint is wholly visible.
    pub(super) fn views_holding(&self, footprint: &Footprint) -> usize {
        let Looks::Views(views) = &self.looks else {
            return 1;
        };
        let rays: Vec<_> = footprint
            .outline()
            .iter()
            .step_by(OUTLINE_STRIDE)
            .filter_map(|point| {
                let pixel = cross_half_pixel(*point, PixelConvention::PixelCentre);
                self.geometry.lens.unproject(&pixel)
            })
            .collect();
        let holds = |view: &VirtualView| rays.iter().all(|ray| view.holds(ray));
        views.iter().filter(|(view, _)| holds(view)).count()
    }
}
