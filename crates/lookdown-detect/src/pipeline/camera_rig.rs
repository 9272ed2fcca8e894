//! Camera rigs: a camera's geometry together with its views or crops and their remap tables.
//!
//! A rig is immutable. All frames of a camera share the rig of a view plan.

use std::sync::Arc;

use lookdown_lens::{
    calibration::CameraGeometry,
    geometry::{BackProjection, Footprint, FrameCrop, Pixel, ViewPlan, VirtualView},
};

use super::outline::{crop_outline, view_outline};
use crate::{
    detection::{BBox, FramePixels, ViewPixels},
    imaging::{Frame, Letterbox, MaskedPixels, NetworkInput, RemapTable},
};

/// A camera ready for frames of one size.
#[derive(Debug)]
pub(super) struct CameraRig {
    geometry: CameraGeometry,
    frame: BBox<FramePixels>,
    masked: Arc<MaskedPixels>,
    views: Views,
    views_outside: usize,
    views_masked: usize,
}

/// The network's views of a frame.
#[derive(Debug)]
enum Views {
    /// Virtual perspective views.
    Virtual(Vec<(VirtualView, RemapTable)>),
    /// Upright crops of the frame.
    Crops(Vec<(FrameCrop, RemapTable)>),
    /// The whole frame, letterboxed.
    Direct(Letterbox),
}

/// The views that show an unmasked part of the lens image, and the number of the others.
struct Visible<V> {
    views: Vec<(V, RemapTable)>,
    /// Views outside the lens image.
    outside: usize,
    /// Views whose part of the lens image is wholly masked.
    masked: usize,
}

impl<V> Visible<V> {
    fn of(planned: impl Iterator<Item = (V, RemapTable)>, masked: &MaskedPixels) -> Self {
        let mut visible = Self {
            views: Vec::new(),
            outside: 0,
            masked: 0,
        };
        for (view, table) in planned {
            if !table.sees_anything() {
                visible.outside += 1;
            } else if !masked.is_empty() && !table.sees_beside(masked) {
                visible.masked += 1;
            } else {
                visible.views.push((view, table));
            }
        }
        visible
    }
}

impl CameraRig {
    /// Builds the remap tables of the views of `plan`. Without a plan, the only view is the whole
    /// frame. Views that show no unmasked part of the lens image are left out.
    pub(super) fn new(
        geometry: CameraGeometry,
        frame_width: u32,
        frame_height: u32,
        plan: Option<&ViewPlan>,
        input: &NetworkInput,
    ) -> Self {
        let masks = &geometry.areas.masks;
        let masked = Arc::new(MaskedPixels::new(masks, frame_width, frame_height));
        let Some(plan) = plan else {
            return Self {
                geometry,
                frame: BBox::of_frame(frame_width, frame_height),
                masked,
                views: Views::Direct(Letterbox::new(frame_width, frame_height, input)),
                views_outside: 0,
                views_masked: 0,
            };
        };
        let views = plan.views(&geometry.mount, input.width, input.height);
        Self::of_views(geometry, masked, views, frame_width, frame_height)
    }

    /// Returns a rig of the same camera with other views.
    pub(super) fn with_views(
        &self,
        views: Vec<VirtualView>,
        frame_width: u32,
        frame_height: u32,
    ) -> Self {
        let (geometry, masked) = (self.geometry.clone(), Arc::clone(&self.masked));
        Self::of_views(geometry, masked, views, frame_width, frame_height)
    }

    /// Returns a rig of the same camera with crops of the frame instead of views.
    pub(super) fn with_crops(
        &self,
        crops: &[FrameCrop],
        frame_width: u32,
        frame_height: u32,
    ) -> Self {
        let tables = crops
            .iter()
            .map(|crop| RemapTable::of_crop(crop, frame_width, frame_height));
        let visible = Visible::of(crops.iter().copied().zip(tables), &self.masked);
        Self {
            geometry: self.geometry.clone(),
            frame: BBox::of_frame(frame_width, frame_height),
            masked: Arc::clone(&self.masked),
            views_outside: visible.outside,
            views_masked: visible.masked,
            views: Views::Crops(visible.views),
        }
    }

    /// Builds a rig from `views`, without those that show no unmasked part of the lens image.
    fn of_views(
        geometry: CameraGeometry,
        masked: Arc<MaskedPixels>,
        views: Vec<VirtualView>,
        frame_width: u32,
        frame_height: u32,
    ) -> Self {
        let tables = RemapTable::of_views(&views, &geometry.lens, frame_width, frame_height);
        let visible = Visible::of(views.into_iter().zip(tables), &masked);
        Self {
            geometry,
            frame: BBox::of_frame(frame_width, frame_height),
            masked,
            views_outside: visible.outside,
            views_masked: visible.masked,
            views: Views::Virtual(visible.views),
        }
    }

    /// Blanks the masked areas of the frame. Must run before any other use of the frame.
    pub(super) fn blank(&self, frame: &mut Frame) {
        self.masked.blank(frame);
    }

    /// Returns true if no pixel of the frame is masked.
    pub(super) fn has_no_masks(&self) -> bool {
        self.masked.is_empty()
    }

    /// Returns the lens, the mount and the areas of the camera.
    pub(super) fn geometry(&self) -> &CameraGeometry {
        &self.geometry
    }

    /// Returns the box of the whole frame.
    pub(super) fn frame(&self) -> &BBox<FramePixels> {
        &self.frame
    }

    /// Returns the number of views that the network processes.
    pub(super) fn view_count(&self) -> usize {
        match &self.views {
            Views::Virtual(views) => views.len(),
            Views::Crops(crops) => crops.len(),
            Views::Direct(_) => 1,
        }
    }

    /// Returns the number of planned views that lie outside the lens image.
    pub(super) fn views_outside(&self) -> usize {
        self.views_outside
    }

    /// Returns the number of planned views whose part of the lens image is wholly masked.
    pub(super) fn views_masked(&self) -> usize {
        self.views_masked
    }

    /// Returns the outlines of the views in corner-origin frame pixels.
    pub(super) fn view_outlines(&self) -> Vec<Vec<Pixel>> {
        match &self.views {
            Views::Virtual(views) => {
                let outlines = views.iter();
                let outlines = outlines.map(|(view, _)| view_outline(view, &self.geometry.lens));
                outlines.collect()
            }
            Views::Crops(crops) => crops.iter().map(|(crop, _)| crop_outline(crop)).collect(),
            Views::Direct(_) => Vec::new(),
        }
    }

    /// Returns the memory of the tables and masks in bytes. Shared memory counts once.
    pub(super) fn bytes(&self) -> usize {
        let tables = match &self.views {
            Views::Virtual(views) => RemapTable::bytes(views.iter().map(|(_, table)| table)),
            Views::Crops(crops) => RemapTable::bytes(crops.iter().map(|(_, table)| table)),
            Views::Direct(_) => 0,
        };
        tables + self.masked.bytes()
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
            Views::Crops(crops) => crops[view].1.render(frame, input, slot),
        }
    }

    /// Returns the footprint in the frame of a box of a view; `None` outside the lens image.
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
            Views::Crops(crops) => {
                Footprint::of_crop_box(bbox.corners(), &crops[view].0, &self.geometry.lens)
            }
            Views::Direct(letterbox) => Some(Footprint::of_frame_box(
                bbox.corners().map(|side| letterbox.frame_from_input(side)),
            )),
        }
    }

    /// Returns the crops; empty for a rig without crops.
    pub(super) fn crops(&self) -> impl Iterator<Item = &FrameCrop> {
        let crops = match &self.views {
            Views::Crops(crops) => crops.as_slice(),
            Views::Virtual(_) | Views::Direct(_) => &[],
        };
        crops.iter().map(|(crop, _)| crop)
    }

    /// Returns true if boxes of the views are exact in the frame, as the boxes of crops are.
    pub(super) fn is_exact(&self) -> bool {
        matches!(self.views, Views::Crops(_))
    }

    /// Returns the number of views that show the whole footprint. The whole frame always does.
    pub(super) fn views_holding(&self, footprint: &Footprint) -> usize {
        match &self.views {
            Views::Virtual(views) => {
                let outline = footprint.rays();
                let holds = |view: &VirtualView| outline.iter().all(|ray| view.holds(ray));
                views.iter().filter(|(view, _)| holds(view)).count()
            }
            Views::Crops(crops) => {
                let [x_min, y_min, x_max, y_max] = footprint.bounds();
                let corners = [Pixel::new(x_min, y_min), Pixel::new(x_max, y_max)];
                let holds = |crop: &FrameCrop| corners.iter().all(|corner| crop.holds(corner));
                crops.iter().filter(|(crop, _)| holds(crop)).count()
            }
            Views::Direct(_) => 1,
        }
    }
}
