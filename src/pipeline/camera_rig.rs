//! Camera rigs: a camera's geometry with the views of a plan and their remap tables, immutable
//! and shared by every frame of that camera.

use super::planned_views::view_outline;
use crate::{
    calibration::CameraGeometry,
    detection::{BBox, FramePixels, ViewPixels},
    geometry::{BackProjection, Footprint, Pixel, Ray, ViewPlan, VirtualView},
    imaging::{Frame, Letterbox, NetworkInput, RemapTable},
};

/// A camera ready for frames of one size.
#[derive(Debug)]
pub(super) struct CameraRig {
    geometry: CameraGeometry,
    frame: BBox<FramePixels>,
    views: Views,
    views_outside: usize,
}

/// How the frame reaches the network.
#[derive(Debug)]
enum Views {
    /// Through virtual views.
    Virtual(Vec<(VirtualView, RemapTable)>),
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
        let Some(plan) = plan else {
            return Self {
                geometry,
                frame: BBox::of_frame(frame_width, frame_height),
                views: Views::Direct(Letterbox::new(frame_width, frame_height, input)),
                views_outside: 0,
            };
        };
        let views = plan.views(&geometry.mount, input.width, input.height);
        Self::of_views(geometry, views, frame_width, frame_height)
    }

    /// The same camera with other views.
    pub(super) fn with_views(
        &self,
        views: Vec<VirtualView>,
        frame_width: u32,
        frame_height: u32,
    ) -> Self {
        Self::of_views(self.geometry.clone(), views, frame_width, frame_height)
    }

    /// Views with their tables, without those that see nothing.
    fn of_views(
        geometry: CameraGeometry,
        views: Vec<VirtualView>,
        frame_width: u32,
        frame_height: u32,
    ) -> Self {
        let planned = views.len();
        let tables = RemapTable::of_views(&views, &geometry.lens, frame_width, frame_height);
        let tabulated = views.into_iter().zip(tables);
        let seeing = tabulated.filter(|(_, table)| table.sees_anything());
        let seeing: Vec<_> = seeing.collect();
        Self {
            geometry,
            frame: BBox::of_frame(frame_width, frame_height),
            views_outside: planned - seeing.len(),
            views: Views::Virtual(seeing),
        }
    }

    /// Lens and mount.
    pub(super) fn geometry(&self) -> &CameraGeometry {
        &self.geometry
    }

    /// The whole frame.
    pub(super) fn frame(&self) -> &BBox<FramePixels> {
        &self.frame
    }

    /// How many views the network has to see.
    pub(super) fn view_count(&self) -> usize {
        match &self.views {
            Views::Virtual(views) => views.len(),
            Views::Direct(_) => 1,
        }
    }

    /// How many of the planned views see nothing of the lens image.
    pub(super) fn views_outside(&self) -> usize {
        self.views_outside
    }

    /// The borders of the views, corner-origin frame pixels.
    pub(super) fn view_outlines(&self) -> Vec<Vec<Pixel>> {
        let Views::Virtual(views) = &self.views else {
            return Vec::new();
        };
        let outlines = views.iter();
        let outlines = outlines.map(|(view, _)| view_outline(view, &self.geometry.lens));
        outlines.collect()
    }

    /// Memory held by the tables, bytes; what several of them share counts once.
    pub(super) fn bytes(&self) -> usize {
        match &self.views {
            Views::Virtual(views) => RemapTable::bytes(views.iter().map(|(_, table)| table)),
            Views::Direct(_) => 0,
        }
    }

    /// Renders one view into its slot `[3, height, width]` of the network's input, on the calling
    /// thread.
    pub(super) fn render_view(
        &self,
        view: usize,
        frame: &Frame,
        input: &NetworkInput,
        slot: &mut [f32],
    ) {
        match &self.views {
            Views::Direct(letterbox) => letterbox.render(frame, input, slot),
            Views::Virtual(views) => views[view].1.render(frame, input, slot),
        }
    }

    /// What a box found in a view covers in the frame; `None` beyond the lens image.
    pub(super) fn footprint(
        &self,
        view: usize,
        bbox: &BBox<ViewPixels>,
        back_projection: BackProjection,
    ) -> Option<Footprint> {
        match &self.views {
            Views::Virtual(views) => Footprint::of_view_box(
                bbox.corners(),
                back_projection,
                &views[view].0,
                &self.geometry.lens,
                &self.geometry.mount,
            ),
            Views::Direct(letterbox) => Some(Footprint::of_frame_box(
                bbox.corners().map(|side| letterbox.frame_from_input(side)),
            )),
        }
    }

    /// How many views show the whole outline (rays); the frame itself shows everything.
    pub(super) fn views_holding(&self, outline: &[Ray]) -> usize {
        let Views::Virtual(views) = &self.views else {
            return 1;
        };
        let holds = |view: &VirtualView| outline.iter().all(|ray| view.holds(ray));
        views.iter().filter(|(view, _)| holds(view)).count()
    }
}
