//! The view plan of a camera, without a frame of it.

use super::{Engine, PipelineError, Profile};
use crate::{
    calibration::Calibration,
    geometry::{
        FrameCrop, Lens, Pixel, VirtualView,
        pixels::{PixelConvention, cross_half_pixel},
        view_plan::Coverage,
    },
    imaging::MaskedPixels,
};

/// Steps along each side of a view between the rays that decide whether it sees the lens image.
const SIGHT_STEPS: u32 = 64;
/// Points of an outline along each side of a view.
const POINTS_PER_SIDE: u32 = 16;

/// How frames of a camera are looked at.
#[derive(Debug, Clone)]
pub struct PlannedViews {
    /// The profile.
    pub profile: Profile,
    /// Name of the model that the views are made for.
    pub model: String,
    /// Width of the frames that outlines are in, pixels.
    pub image_width: u32,
    /// Height of the frames that outlines are in, pixels.
    pub image_height: u32,
    /// The views that see some of the lens image beside its masks, in plan order; none for [`Profile::Direct`].
    pub views: Vec<PlannedView>,
    /// Share of the lens image that lies in at least one view, 0 to 1.
    pub seen_share: f64,
    /// In how many views a place of the lens image lies on average.
    pub mean_views: f64,
    /// How many pictures the network sees of every frame.
    pub pictures: usize,
    /// Most pictures it sees besides, of places that the views made interesting.
    pub zoomed_pictures_at_most: usize,
    /// How many times the network is run for the views.
    pub batches: usize,
    /// Pixels of the pictures of every frame.
    pub pixels: u64,
}

/// A view and where it passes in the frame.
#[derive(Debug, Clone)]
pub struct PlannedView {
    /// The view.
    pub view: VirtualView,
    /// Its border, clockwise from the top left corner of the view, corner-origin frame pixels.
    pub outline: Vec<Pixel>,
}

impl PlannedView {
    /// Where the nodes of a grid of `cells` × `cells` over the whole view lie in the frame, row by row from the top
    /// left corner of the view, corner-origin frame pixels; `None` beyond the lens image.
    #[must_use]
    pub fn grid(&self, lens: &Lens, cells: u32) -> Vec<Option<Pixel>> {
        let place =
            |index: u32, side: u32| f64::from(index) / f64::from(cells) * f64::from(side) - 0.5;
        let (width, height) = (self.view.width(), self.view.height());
        let nodes = (0..=cells).flat_map(|row| (0..=cells).map(move |column| (column, row)));
        let nodes = nodes.map(|(column, row)| {
            let pixel = Pixel::new(place(column, width), place(row, height));
            let seen = lens.project(&self.view.ray_in_camera(&pixel))?;
            Some(cross_half_pixel(seen, PixelConvention::CornerOrigin))
        });
        nodes.collect()
    }
}

impl Engine {
    /// The views through which frames of `calibration` are looked at, at the frame size that it
    /// was made for. Blocks for some ten milliseconds.
    ///
    /// # Errors
    /// [`PipelineError::ModelStarting`] while the profile's model is not loaded.
    pub fn planned_views(
        &self,
        calibration: &Calibration,
        profile: Profile,
    ) -> Result<PlannedViews, PipelineError> {
        let (model, options) = (self.default_model(profile)?, self.options());
        let input = model.input();
        let (lens, (image_width, image_height)) = (calibration.lens(), calibration.image_size());
        let masks = &calibration.areas().masks;
        let masked = MaskedPixels::new(masks, image_width, image_height);
        let plan = profile.view_plan(options.paper_field_of_view);
        let views = plan.as_ref().map(|plan| {
            let mut views = plan.views(calibration.mount(), input.width, input.height);
            views.retain(|view| sees(view, lens, &masked));
            views
        });
        let coverage = views
            .as_ref()
            .map(|views| Coverage::of(lens, views, image_width, image_height));
        let pictures = views.as_ref().map_or(1, Vec::len);
        Ok(PlannedViews {
            profile,
            model: model.name().to_owned(),
            image_width,
            image_height,
            seen_share: coverage.map_or(1.0, |coverage| coverage.seen_share),
            mean_views: coverage.map_or(1.0, |coverage| coverage.mean_views),
            pictures,
            zoomed_pictures_at_most: profile.max_second_pass_views(),
            batches: pictures.div_ceil(options.batches.max_views.get()),
            pixels: pictures as u64 * u64::from(input.width) * u64::from(input.height),
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

/// Whether some of the lens image is in the view that is not masked.
fn sees(view: &VirtualView, lens: &Lens, masked: &MaskedPixels) -> bool {
    let place =
        |index: u32, side: u32| f64::from(index) / f64::from(SIGHT_STEPS) * f64::from(side) - 0.5;
    (0..=SIGHT_STEPS).any(|row| {
        (0..=SIGHT_STEPS).any(|column| {
            let pixel = Pixel::new(place(column, view.width()), place(row, view.height()));
            let seen = lens.project(&view.ray_in_camera(&pixel));
            seen.is_some_and(|pixel| !masked.hides_position(pixel))
        })
    })
}

/// The border of a view, clockwise from its top left corner, corner-origin frame pixels; what lies
/// beyond the lens image is pulled to its rim.
pub(super) fn view_outline(view: &VirtualView, lens: &Lens) -> Vec<Pixel> {
    let rays = view.border_rays(POINTS_PER_SIDE);
    rays.filter_map(|ray| lens.project_to_rim(&ray))
        .map(|pixel| cross_half_pixel(pixel, PixelConvention::CornerOrigin))
        .collect()
}

/// The border of a crop, clockwise from its top left corner, corner-origin frame pixels.
pub(super) fn crop_outline(crop: &FrameCrop) -> Vec<Pixel> {
    let (width, height) = (f64::from(crop.width), f64::from(crop.height));
    let corners = [[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]];
    let corners = corners.map(|[x, y]| crop.frame_from_crop(&Pixel::new(x, y)));
    corners.to_vec()
}
