//! The view plan of a camera, without a frame of it.

use lookdown_calibration::Calibration;
use lookdown_lens::geometry::{
    Lens, Pixel, Polygon, VirtualView, foot_filter::AreaReach, pixels::to_corner_origin,
    view_plan::Coverage,
};

use super::{Engine, PipelineError, outline::view_outline};
use crate::parameters::Profile;
use lookdown_imaging::MaskedPixels;

/// Steps along each side of a view between the rays that test whether it covers the lens image.
const SIGHT_STEPS: u32 = 64;
/// Most products of rows and edges for which masks are computed. Five masks of ten corners are
/// exact in frames of up to 20,000 rows. But a plan may be for 65,536 rows, which are never
/// decoded, and 32 masks with 64 corners each would take seconds in so many.
const MAX_MASK_WORK: usize = 1 << 20;

/// The view plan of a camera and its cost.
#[derive(Debug, Clone)]
pub struct PlannedViews {
    /// The profile.
    pub profile: Profile,
    /// Name of the model for which the views are planned.
    pub model: String,
    /// Frame width that the outlines refer to, pixels.
    pub image_width: u32,
    /// Frame height that the outlines refer to, pixels.
    pub image_height: u32,
    /// The views that can show a person, in plan order. Empty for
    /// [`Profile::Direct`].
    pub views: Vec<PlannedView>,
    /// Share of the lens image that lies in at least one view, 0 to 1.
    pub seen_share: f64,
    /// The mean number of views that cover a position in the lens image.
    pub mean_views: f64,
    /// The maximum number of network inputs for the views: detail views are processed only where
    /// the others show a possible person.
    pub images: usize,
    /// The maximum number of additional upright crops, with mirrored copies.
    pub crops_at_most: usize,
    /// The maximum number of runs of the network for the views.
    pub batches: usize,
    /// The number of pixels of these network inputs.
    pub pixels: u64,
}

/// A view and its outline in the frame.
#[derive(Debug, Clone)]
pub struct PlannedView {
    /// The view.
    pub view: VirtualView,
    /// The border, clockwise from the top left corner of the view, corner-origin frame pixels.
    pub outline: Vec<Pixel>,
}

impl PlannedView {
    /// Returns the nodes of a grid of `cells` × `cells` over the view, row by row from its top left
    /// corner, in corner-origin frame pixels. Nodes beyond the lens image are `None`.
    pub fn grid(&self, lens: &Lens, cells: u32) -> Vec<Option<Pixel>> {
        let nodes = (0..=cells).flat_map(|row| (0..=cells).map(move |column| [column, row]));
        let nodes = nodes.map(|at| {
            let seen = node(&self.view, lens, cells, at)?;
            Some(to_corner_origin(seen))
        });
        nodes.collect()
    }
}

impl Engine {
    /// Plans the views for frames of `calibration` at the frame size of the calibration. Blocks for
    /// some ten milliseconds.
    ///
    /// # Errors
    /// [`PipelineError::ModelStarting`] while the default model is not loaded.
    pub fn planned_views(
        &self,
        calibration: &Calibration,
        profile: Profile,
    ) -> Result<PlannedViews, PipelineError> {
        let (model, options) = (self.default_model()?, &self.options);
        let input = &model.input;
        let (lens, (image_width, image_height)) = (calibration.lens(), calibration.image_size());
        let masked = CoarseMasks::new(&calibration.areas().masks, image_width, image_height);
        let areas = &calibration.areas().foot_filter;
        let reach = AreaReach::new(areas, lens, calibration.mount(), image_width, image_height);
        let counts = |pixel: Pixel| {
            let at = to_corner_origin(pixel);
            !masked.hides_position(pixel) && reach.as_ref().is_none_or(|reach| reach.holds(at))
        };
        let plan = profile.view_plan();
        let views = plan.as_ref().map(|plan| {
            let mut views = plan.views(calibration.mount(), input.width, input.height);
            views.retain(|view| sees(view, lens, counts));
            views
        });
        let coverage = views
            .as_ref()
            .map(|views| Coverage::new(lens, views, image_width, image_height));
        let images = views.as_ref().map_or(1, Vec::len);
        Ok(PlannedViews {
            profile,
            model: model.name.clone(),
            image_width,
            image_height,
            seen_share: coverage.map_or(1.0, |coverage| coverage.seen_share),
            mean_views: coverage.map_or(1.0, |coverage| coverage.mean_views),
            images,
            crops_at_most: profile.max_crop_inputs(),
            batches: images.div_ceil(options.batches.max_views.get()),
            pixels: images as u64 * u64::from(input.width) * u64::from(input.height),
            views: views
                .into_iter()
                .flatten()
                .map(|view| PlannedView {
                    outline: view_outline(&view, lens),
                    view,
                })
                .collect(),
        })
    }
}

/// The masks of frames of any height, in fewer rows than the frame has if they have many edges.
struct CoarseMasks {
    masked: MaskedPixels,
    rows_per_pixel: f64,
}

impl CoarseMasks {
    fn new(masks: &[Polygon], width: u32, height: u32) -> Self {
        let edges: usize = masks.iter().map(|mask| mask.edges().count()).sum();
        let most = MAX_MASK_WORK / edges.max(1);
        let rows = u32::try_from(most).map_or(height, |most| height.min(most));
        let rows_per_pixel = f64::from(rows) / f64::from(height);
        let masks: Vec<_> = masks
            .iter()
            .map(|mask| mask.scaled(1.0, rows_per_pixel))
            .collect();
        Self {
            masked: MaskedPixels::new(&masks, width, rows),
            rows_per_pixel,
        }
    }

    /// Returns true if the row and the pixel that contain a position (pixel centers) are masked.
    fn hides_position(&self, at: Pixel) -> bool {
        let row = (at.y + 0.5) * self.rows_per_pixel - 0.5;
        self.masked.hides_position(Pixel::new(at.x, row))
    }
}

/// Returns true when the view covers some part of the lens image for which `counts` holds.
fn sees(view: &VirtualView, lens: &Lens, counts: impl Fn(Pixel) -> bool) -> bool {
    (0..=SIGHT_STEPS).any(|row| {
        (0..=SIGHT_STEPS)
            .any(|column| node(view, lens, SIGHT_STEPS, [column, row]).is_some_and(&counts))
    })
}

/// Returns the pixel of a node of a grid of `cells` × `cells` over a view, if the lens sees it.
fn node(view: &VirtualView, lens: &Lens, cells: u32, [column, row]: [u32; 2]) -> Option<Pixel> {
    let place = |index: u32, side: u32| f64::from(index) / f64::from(cells) * f64::from(side) - 0.5;
    let pixel = Pixel::new(place(column, view.width), place(row, view.height));
    lens.project(&view.ray_in_camera(&pixel))
}
