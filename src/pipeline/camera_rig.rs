//! Camera rigs: a camera's geometry with the views of a plan or the crops of a frame and their remap
//! tables, immutable; those of a plan are shared by every frame of that camera.

use std::sync::Arc;

use super::planned_views::{crop_outline, view_outline};
use crate::{
    calibration::CameraGeometry,
    detection::{BBox, FramePixels, ViewPixels},
    geometry::{BackProjection, Footprint, FrameCrop, Pixel, ViewPlan, VirtualView},
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

/// How the frame reaches the network.
#[derive(Debug)]
enum Views {
    /// Through virtual views.
    Virtual(Vec<(VirtualView, RemapTable)>),
    /// In upright crops of it.
    Crops(Vec<(FrameCrop, RemapTable)>),
    /// As it is.
    Direct(Letterbox),
}

impl CameraRig {
    /// Tabulates the views of `plan` (without one, the frame is seen as it is). Views that see
    /// nothing of the lens image, or nothing beside its masks, are left out.
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

    /// The same camera with other views.
    pub(super) fn with_views(
        &self,
        views: Vec<VirtualView>,
        frame_width: u32,
        frame_height: u32,
    ) -> Self {
        let (geometry, masked) = (self.geometry.clone(), Arc::clone(&self.masked));
        Self::of_views(geometry, masked, views, frame_width, frame_height)
    }

    /// The same camera with crops of the frame instead of views.
    pub(super) fn with_crops(
        &self,
        crops: &[FrameCrop],
        frame_width: u32,
        frame_height: u32,
    ) -> Self {
        let tabulated = crops.iter().map(|crop| {
            let table = RemapTable::of_crop(crop, frame_width, frame_height);
            (*crop, table)
        });
        let shows_something = |(_, table): &(_, RemapTable)| {
            if self.masked.is_empty() {
                table.sees_anything()
            } else {
                table.sees_beside(&self.masked)
            }
        };
        Self {
            geometry: self.geometry.clone(),
            frame: BBox::of_frame(frame_width, frame_height),
            masked: Arc::clone(&self.masked),
            views: Views::Crops(tabulated.filter(shows_something).collect()),
            views_outside: 0,
            views_masked: 0,
        }
    }

    /// Views with their tables, without those that see nothing.
    fn of_views(
        geometry: CameraGeometry,
        masked: Arc<MaskedPixels>,
        views: Vec<VirtualView>,
        frame_width: u32,
        frame_height: u32,
    ) -> Self {
        let planned = views.len();
        let tables = RemapTable::of_views(&views, &geometry.lens, frame_width, frame_height);
        let tabulated = views.into_iter().zip(tables);
        let within = tabulated.filter(|(_, table)| table.sees_anything());
        let mut views: Vec<_> = within.collect();
        let views_outside = planned - views.len();
        if !masked.is_empty() {
            views.retain(|(_, table)| table.sees_beside(&masked));
        }
        Self {
            geometry,
            frame: BBox::of_frame(frame_width, frame_height),
            masked,
            views_outside,
            views_masked: planned - views_outside - views.len(),
            views: Views::Virtual(views),
        }
    }

    /// Blanks what the camera's masks hide; nothing else may see the frame before.
    pub(super) fn blank(&self, frame: &mut Frame) {
        self.masked.blank(frame);
    }

    /// Whether the camera has no masks that hide anything.
    pub(super) fn hides_nothing(&self) -> bool {
        self.masked.is_empty()
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
            Views::Crops(crops) => crops.len(),
            Views::Direct(_) => 1,
        }
    }

    /// How many of the planned views see nothing of the lens image.
    pub(super) fn views_outside(&self) -> usize {
        self.views_outside
    }

    /// How many of the planned views see nothing of it beside what is masked.
    pub(super) fn views_masked(&self) -> usize {
        self.views_masked
    }

    /// The borders of the views, corner-origin frame pixels.
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

    /// Memory held by the tables and masks, bytes; what several of them share counts once.
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
            Views::Crops(crops) => {
                Footprint::of_crop_box(bbox.corners(), &crops[view].0, &self.geometry.lens)
            }
            Views::Direct(letterbox) => Some(Footprint::of_frame_box(
                bbox.corners().map(|side| letterbox.frame_from_input(side)),
            )),
        }
    }

    /// The crops; none of a rig of virtual views.
    pub(super) fn crops(&self) -> impl Iterator<Item = &FrameCrop> {
        let crops = match &self.views {
            Views::Crops(crops) => crops.as_slice(),
            Views::Virtual(_) | Views::Direct(_) => &[],
        };
        crops.iter().map(|(crop, _)| crop)
    }

    /// Whether boxes of the views are exact in the frame, as those of crops are.
    pub(super) fn is_exact(&self) -> bool {
        matches!(self.views, Views::Crops(_))
    }

    /// How many views show the whole footprint; the frame itself shows everything.
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
