//! The outlines of views and crops in the frame.

use lookdown_lens::geometry::{FrameCrop, Lens, Pixel, VirtualView, pixels::to_corner_origin};

/// Points of an outline along each side of a view.
const POINTS_PER_SIDE: u32 = 16;

/// Returns the border of a view, clockwise from its top left corner, corner-origin frame pixels.
/// Points beyond the lens image are moved to its rim.
pub(super) fn view_outline(view: &VirtualView, lens: &Lens) -> Vec<Pixel> {
    let rays = view.border_rays(POINTS_PER_SIDE);
    rays.filter_map(|ray| lens.project_to_rim(&ray))
        .map(to_corner_origin)
        .collect()
}

/// Returns the border of a crop, clockwise from its top left corner, corner-origin frame pixels.
pub(super) fn crop_outline(crop: &FrameCrop) -> Vec<Pixel> {
    let (width, height) = (f64::from(crop.width), f64::from(crop.height));
    let corners = [[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]];
    let corners = corners.map(|[x, y]| crop.frame_from_crop(&Pixel::new(x, y)));
    corners.to_vec()
}
