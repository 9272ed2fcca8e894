//! Camera rigs: a camera's geometry together with its views or crops and their remap tables.
//!
//! A rig is immutable. All frames of a camera share the rig of a view plan.

use std::sync::Arc;

use lookdown_calibration::CameraGeometry;
use lookdown_imaging::{Frame, Letterbox, MaskedPixels, NetworkInput, RemapTable};
use lookdown_lens::geometry::{
    BackProjection, Footprint, FrameCrop, Pixel, ViewPlan, VirtualView, crop_placement::CropTarget,
    foot_filter::AreaReach, pixels::to_pixel_center,
};

use nalgebra::Vector2;

use super::{
    mosaic::Mosaics,
    outline::{crop_outline, view_outline},
};
use crate::{
    detection::{BBox, FramePixels, ViewPixels},
    inference::ViewDetection,
};

/// Distance to the view's border, as a share of the view's width, below which a box is considered
/// cut off.
const BORDER_SHARE: f64 = 0.0125;

/// A camera ready for frames of one size.
#[derive(Debug)]
pub(super) struct CameraRig {
    /// The lens, the mount and the areas of the camera.
    pub(super) geometry: CameraGeometry,
    /// The box of the whole frame.
    pub(super) frame: BBox<FramePixels>,
    hidden: Hidden,
    views: Views,
    /// Views of parts of the frame, for those that may show a person.
    details: Vec<(VirtualView, RemapTable)>,
    /// The numbers of planned views that the network does not process.
    pub(super) left_out: LeftOut,
}

/// The network's views of a frame.
#[derive(Debug)]
enum Views {
    /// Virtual perspective views.
    Virtual(Vec<(VirtualView, RemapTable)>),
    /// Upright crops of the frame.
    Crops(Mosaics),
    /// The whole frame, letterboxed.
    Direct(Letterbox),
}

impl CameraRig {
    /// Builds the remap tables of the views of `plan`. Without a plan, the only view is the whole
    /// frame. Views that can show no person are left out: those outside the lens image, those that
    /// are wholly masked, and those far from all areas.
    pub(super) fn new(
        geometry: CameraGeometry,
        frame_width: u32,
        frame_height: u32,
        plan: Option<&ViewPlan>,
        input: &NetworkInput,
    ) -> Self {
        let hidden = Hidden::new(&geometry, frame_width, frame_height);
        let Some(plan) = plan else {
            return Self {
                geometry,
                frame: BBox::for_frame(frame_width, frame_height),
                hidden,
                views: Views::Direct(Letterbox::new(frame_width, frame_height, input)),
                details: Vec::new(),
                left_out: LeftOut::default(),
            };
        };
        let views = plan.views(&geometry.mount, input.width, input.height);
        let tables = RemapTable::for_views(&views, &geometry.lens, frame_width, frame_height);
        let mut planned = views.into_iter().zip(tables);
        let views = Visible::new(planned.by_ref().take(plan.constant_count), &hidden);
        let details = Visible::new(planned, &hidden);
        Self {
            geometry,
            frame: BBox::for_frame(frame_width, frame_height),
            hidden,
            left_out: views.left_out.and(details.left_out),
            views: Views::Virtual(views.views),
            details: details.views,
        }
    }

    /// Returns a rig of the same camera with those detail views that show the middle of a target;
    /// `None` if there are none.
    pub(super) fn with_details_of(&self, targets: &[CropTarget]) -> Option<Self> {
        let lens = &self.geometry.lens;
        let rays: Vec<_> = targets
            .iter()
            .filter_map(|target| {
                let pixel = to_pixel_center(target.center());
                lens.unproject(&pixel)
            })
            .collect();
        let shown = self.details.iter();
        let shown = shown.filter(|(view, _)| rays.iter().any(|ray| view.holds(ray)));
        let shown: Vec<_> = shown.cloned().collect();
        (!shown.is_empty()).then(|| Self {
            geometry: self.geometry.clone(),
            frame: self.frame,
            hidden: self.hidden.clone(),
            views: Views::Virtual(shown),
            details: Vec::new(),
            left_out: LeftOut::default(),
        })
    }

    /// Returns a rig of the same camera with crops of the frame instead of views. Small ones share
    /// a square of `side` pixels in the input of the network.
    pub(super) fn with_crops(
        &self,
        side: u32,
        crops: &[FrameCrop],
        frame_width: u32,
        frame_height: u32,
    ) -> Self {
        let tables = crops
            .iter()
            .map(|crop| RemapTable::for_crop(crop, frame_width, frame_height));
        let visible = Visible::new(crops.iter().copied().zip(tables), &self.hidden);
        Self {
            geometry: self.geometry.clone(),
            frame: BBox::for_frame(frame_width, frame_height),
            hidden: self.hidden.clone(),
            left_out: visible.left_out,
            views: Views::Crops(Mosaics::new(side, visible.views)),
            details: Vec::new(),
        }
    }

    /// Blanks the masked areas of the frame. Must run before any other use of the frame.
    pub(super) fn blank(&self, frame: &mut Frame) {
        self.hidden.masked.blank(frame);
    }

    /// Returns true if no pixel of the frame is masked.
    pub(super) fn has_no_masks(&self) -> bool {
        self.hidden.masked.is_empty()
    }

    /// Returns the number of detail views.
    pub(super) fn detail_count(&self) -> usize {
        self.details.len()
    }

    /// Returns the virtual views; empty for a rig of other views.
    pub(super) fn virtual_views(&self) -> impl Iterator<Item = &VirtualView> {
        let views = match &self.views {
            Views::Virtual(views) => views.as_slice(),
            Views::Crops(_) | Views::Direct(_) => &[],
        };
        views.iter().map(|(view, _)| view)
    }

    /// Returns the number of inputs that the network processes: views, or mosaics of crops.
    pub(super) fn view_count(&self) -> usize {
        match &self.views {
            Views::Virtual(views) => views.len(),
            Views::Crops(mosaics) => mosaics.inputs().len(),
            Views::Direct(_) => 1,
        }
    }

    /// Divides the detections in each input of the network into those of each view or crop.
    pub(super) fn per_view(&self, per_input: Vec<Vec<ViewDetection>>) -> Vec<Vec<ViewDetection>> {
        match &self.views {
            Views::Crops(mosaics) => mosaics.per_crop(per_input),
            Views::Virtual(_) | Views::Direct(_) => per_input,
        }
    }

    /// Returns true if a position in the frame (corner-origin) can show a person who counts.
    pub(super) fn shows(&self, position: Pixel) -> bool {
        let pixel = to_pixel_center(position);
        let reach = self.hidden.reach.as_ref();
        self.geometry.lens.unproject(&pixel).is_some()
            && reach.is_none_or(|reach| reach.holds(position))
    }

    /// Returns the boxes of the pixels that cannot show a person in an area.
    pub(super) fn unsearched(&self) -> Vec<[f64; 4]> {
        let reach = self.hidden.reach.as_ref();
        reach.map_or_else(Vec::new, |reach| reach.boxes_outside())
    }

    /// Returns the outlines of the views in corner-origin frame pixels.
    pub(super) fn view_outlines(&self) -> Vec<Vec<Pixel>> {
        match &self.views {
            Views::Virtual(views) => {
                let outlines = views.iter();
                let outlines = outlines.map(|(view, _)| view_outline(view, &self.geometry.lens));
                outlines.collect()
            }
            Views::Crops(_) => self.crops().map(crop_outline).collect(),
            Views::Direct(_) => Vec::new(),
        }
    }

    /// Returns the memory of the tables and masks in bytes. Shared memory counts once.
    pub(super) fn bytes(&self) -> usize {
        let tables = match &self.views {
            Views::Virtual(views) => {
                let views = views.iter().chain(&self.details);
                RemapTable::bytes(views.map(|(_, table)| table))
            }
            Views::Crops(mosaics) => {
                RemapTable::bytes(mosaics.crops.iter().map(|(_, table)| table))
            }
            Views::Direct(_) => 0,
        };
        let reach = self.hidden.reach.as_ref().map_or(0, |reach| reach.bytes());
        tables + self.hidden.masked.bytes() + reach
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
            Views::Crops(mosaics) => mosaics.render(view, frame, input, slot),
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
            Views::Virtual(views) => Footprint::from_view_box(
                bbox.corners(),
                back_projection,
                &views[view].0,
                &self.geometry.lens,
                &self.geometry.mount,
            ),
            Views::Crops(mosaics) => {
                let crop = &mosaics.crops[view].0;
                Footprint::from_crop_box(bbox.corners(), crop, &self.geometry.lens)
            }
            Views::Direct(letterbox) => Some(Footprint::from_frame_box(
                bbox.corners().map(|side| letterbox.frame_from_input(side)),
            )),
        }
    }

    /// Returns vectors across the sides of a box of a view, in the frame and as long as these sides
    /// are apart; `None` outside the lens image, and for the whole frame.
    pub(super) fn widths(&self, view: usize, bbox: &BBox<ViewPixels>) -> Option<[Vector2<f64>; 2]> {
        let [x_min, y_min, x_max, y_max] = bbox.corners();
        let in_frame = |x: f64, y: f64| match &self.views {
            Views::Virtual(views) => {
                let ray = views[view]
                    .0
                    .ray_in_camera(&to_pixel_center(Pixel::new(x, y)));
                self.geometry.lens.project(&ray)
            }
            Views::Crops(mosaics) => Some(mosaics.crops[view].0.frame_from_crop(&Pixel::new(x, y))),
            Views::Direct(_) => None,
        };
        let falling = in_frame(x_max, y_max)? - in_frame(x_min, y_min)?;
        let rising = in_frame(x_max, y_min)? - in_frame(x_min, y_max)?;
        let (right, down) = ((falling + rising) / 2.0, (falling - rising) / 2.0);
        let across = |width: Vector2<f64>, side: Vector2<f64>| {
            let normal = Vector2::new(-side.y, side.x).try_normalize(f64::EPSILON);
            normal.map_or_else(Vector2::zeros, |normal| normal * width.dot(&normal))
        };
        Some([across(right, down), across(down, right)])
    }

    /// Returns the crops; empty for a rig without crops.
    pub(super) fn crops(&self) -> impl Iterator<Item = &FrameCrop> {
        self.placed_crops().iter().map(|(crop, _)| crop)
    }

    fn placed_crops(&self) -> &[(FrameCrop, RemapTable)] {
        match &self.views {
            Views::Crops(mosaics) => &mosaics.crops,
            Views::Virtual(_) | Views::Direct(_) => &[],
        }
    }

    /// Returns the crops of each input of the network; empty for a rig without crops.
    pub(super) fn crops_of_inputs(&self) -> Vec<Vec<FrameCrop>> {
        match &self.views {
            Views::Crops(mosaics) => mosaics
                .inputs()
                .map(|crops| crops.iter().map(|(crop, _)| *crop).collect())
                .collect(),
            Views::Virtual(_) | Views::Direct(_) => Vec::new(),
        }
    }

    /// Returns the view whose vote a view shares: a mirrored crop shares that of its original,
    /// which comes before it, and any other view has its own.
    pub(super) fn voter(&self, view: usize) -> usize {
        let crops = self.placed_crops();
        let Some((crop, _)) = crops.get(view) else {
            return view;
        };
        let original = crops[..view].iter();
        let mut original = original.map(|(other, _)| other);
        let original = original.position(|other| crop.is_mirrored && *other == crop.mirrored());
        original.unwrap_or(view)
    }

    /// Returns true if a box of a view touches the border of the view.
    pub(super) fn cuts_off(
        &self,
        view: usize,
        bbox: &BBox<ViewPixels>,
        input: &NetworkInput,
    ) -> bool {
        match self.placed_crops().get(view) {
            Some((crop, _)) => touches_border(bbox.corners(), crop.width, crop.height),
            None => touches_border(bbox.corners(), input.width, input.height),
        }
    }

    /// Returns true if boxes of the views are exact in the frame, as the boxes of crops are.
    pub(super) fn is_exact(&self) -> bool {
        matches!(self.views, Views::Crops(_))
    }

    /// Returns the number of views with a vote of their own ([`voter`](Self::voter)) that show the
    /// whole footprint. The whole frame always does.
    pub(super) fn views_holding(&self, footprint: &Footprint) -> usize {
        match &self.views {
            Views::Virtual(views) => {
                let outline = &footprint.rays;
                let holds = |view: &VirtualView| outline.iter().all(|ray| view.holds(ray));
                views.iter().filter(|(view, _)| holds(view)).count()
            }
            Views::Crops(_) => {
                let [x_min, y_min, x_max, y_max] = footprint.bounds();
                let corners = [Pixel::new(x_min, y_min), Pixel::new(x_max, y_max)];
                let holds = |crop: &&FrameCrop| corners.iter().all(|corner| crop.holds(corner));
                let voters = self.crops().filter(|crop| !crop.is_mirrored);
                voters.filter(holds).count()
            }
            Views::Direct(_) => 1,
        }
    }
}

fn touches_border([x_min, y_min, x_max, y_max]: [f64; 4], width: u32, height: u32) -> bool {
    let (width, height) = (f64::from(width), f64::from(height));
    let margin = BORDER_SHARE * width;
    x_min < margin || y_min < margin || x_max > width - margin || y_max > height - margin
}

/// The pixels of a frame that show no person who counts.
#[derive(Debug, Clone)]
struct Hidden {
    masked: Arc<MaskedPixels>,
    /// The pixels that can show a person of the areas; `None` without areas.
    reach: Option<Arc<AreaReach>>,
}

impl Hidden {
    fn new(geometry: &CameraGeometry, width: u32, height: u32) -> Self {
        let CameraGeometry { lens, mount, areas } = geometry;
        let reach = AreaReach::new(&areas.foot_filter, lens, mount, width, height);
        Self {
            masked: Arc::new(MaskedPixels::new(&areas.masks, width, height)),
            reach: reach.map(Arc::new),
        }
    }

    /// Returns true if a view shows an unmasked pixel that can show a person of the areas.
    fn leaves_something(&self, table: &RemapTable) -> bool {
        let Some(reach) = &self.reach else {
            return true;
        };
        table.sees_pixel(|x, y| {
            reach.holds(Pixel::new(f64::from(x) + 0.5, f64::from(y) + 0.5))
                && !self.masked.hides(x, y)
        })
    }
}

/// The numbers of planned views that the network does not process.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct LeftOut {
    /// Views outside the lens image.
    pub outside: usize,
    /// Views whose part of the lens image is wholly masked.
    pub masked: usize,
    /// Views that cannot show a person in an area.
    pub outside_areas: usize,
}

impl LeftOut {
    /// Returns the sums.
    fn and(self, other: Self) -> Self {
        Self {
            outside: self.outside + other.outside,
            masked: self.masked + other.masked,
            outside_areas: self.outside_areas + other.outside_areas,
        }
    }
}

/// The views that can show a person, and the numbers of the others.
struct Visible<V> {
    views: Vec<(V, RemapTable)>,
    left_out: LeftOut,
}

impl<V> Visible<V> {
    fn new(planned: impl Iterator<Item = (V, RemapTable)>, hidden: &Hidden) -> Self {
        let mut views = Vec::new();
        let mut left_out = LeftOut::default();
        let masked = &hidden.masked;
        for (view, table) in planned {
            if !table.sees_anything() {
                left_out.outside += 1;
            } else if !masked.is_empty() && !table.sees_beside(masked) {
                left_out.masked += 1;
            } else if !hidden.leaves_something(&table) {
                left_out.outside_areas += 1;
            } else {
                views.push((view, table));
            }
        }
        Self { views, left_out }
    }
}
