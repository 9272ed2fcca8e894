//! Footprints: what a box found in a view covers in the fisheye frame.

use std::{f64::consts::TAU, sync::LazyLock};

use nalgebra::Vector2;

use super::{
    FrameCrop, Lens, Mount, Pixel, Ray, VirtualView,
    height_ratio::Extremities,
    hull::{hull, middle},
    pixels::{to_corner_origin, to_pixel_center},
};

/// Points on an inscribed ellipse: more change the hull by less than 0.2 % of its size.
const ELLIPSE_POINTS: usize = 32;
/// Sine and cosine of the angles at which these points lie: thousands of ellipses have the same.
static ELLIPSE_ANGLES: LazyLock<[(f64, f64); ELLIPSE_POINTS]> = LazyLock::new(|| {
    std::array::from_fn(|index| {
        let share = TAU * index as f64 / ELLIPSE_POINTS as f64;
        share.sin_cos()
    })
});
/// The tilted ellipse is not determined near 45°: squared direction components at least this far
/// apart keep the solution stable.
const MIN_TILT_DETERMINANT: f64 = 0.18;
/// A tilted ellipse thinner than this (ratio of squared axes) is not a person.
const MIN_SQUARED_AXIS_RATIO: f64 = 0.04;
/// The ray of one in this many outline points is kept.
const RAY_STRIDE: usize = 4;
/// A box of which less than this share of the outline lies in the lens image is not mapped.
const MIN_INSIDE_SHARE: f64 = 0.5;

/// The method by which a box is taken back to the frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BackProjection {
    /// The axis-parallel hull of the four mapped corners: the paper's way, oversized at oblique
    /// azimuths (Seidel et al., section III-C).
    CornerHull,
    /// The hull of the inscribed ellipse whose major axis lies along the projected vertical at
    /// the box center: persons are upright ellipsoids far more than they are boxes.
    TiltedEllipse,
}

/// An outline in the frame, corner-origin pixels, never empty.
#[derive(Debug, Clone, PartialEq)]
pub struct Footprint {
    /// The outline's points, corner-origin frame pixels.
    pub outline: Vec<Pixel>,
    /// Some of the outline's points as rays (camera frame, any length); none of a box found in the
    /// frame itself.
    pub rays: Vec<Ray>,
    /// The ends of the outline along the vertical and across it; `None` for corner hulls, which
    /// know no vertical.
    pub extremities: Option<Extremities>,
}

impl Footprint {
    /// Maps the box `[x_min, y_min, x_max, y_max]` (corner-origin view pixels) to the frame.
    /// Outline points beyond the lens image are pulled to its rim. `None` when most of the
    /// outline lies beyond it.
    pub fn from_view_box(
        view_box: [f64; 4],
        back_projection: BackProjection,
        view: &VirtualView,
        lens: &Lens,
        mount: &Mount,
    ) -> Option<Self> {
        match back_projection {
            BackProjection::CornerHull => {
                let rays = corners(view_box).map(|corner| ray_through(corner, view));
                Self::from_outline(rays, None, lens)
            }
            BackProjection::TiltedEllipse => {
                let ellipse = Ellipse::inscribed(view_box, view, mount);
                Self::from_outline(ellipse.outline(), Some(ellipse.extremities()), lens)
            }
        }
    }

    /// Maps an outline (camera frame) to the frame.
    fn from_outline<const POINTS: usize>(
        outline_in_camera: [Ray; POINTS],
        extremities: Option<Extremities>,
        lens: &Lens,
    ) -> Option<Self> {
        let mut inside = 0_usize;
        let mut outline = Vec::with_capacity(POINTS);
        let mut rays = Vec::with_capacity(POINTS.div_ceil(RAY_STRIDE));
        for (index, ray) in outline_in_camera.into_iter().enumerate() {
            let seen = lens.project(&ray);
            inside += usize::from(seen.is_some());
            let Some(in_frame) = seen.or_else(|| lens.project_to_rim(&ray)) else {
                continue;
            };
            outline.push(to_corner_origin(in_frame));
            if index.is_multiple_of(RAY_STRIDE) {
                // What was pulled to the rim is seen there.
                rays.extend(match seen {
                    Some(_) => Some(ray),
                    None => lens.unproject(&in_frame),
                });
            }
        }
        let inside_share = inside as f64 / POINTS as f64;
        (inside_share >= MIN_INSIDE_SHARE && !outline.is_empty()).then_some(Self {
            outline,
            rays,
            extremities,
        })
    }

    /// Maps the box `[x_min, y_min, x_max, y_max]` of a crop to the frame. Its bounds are exact:
    /// the outline is the inscribed ellipse, which touches all four sides. `None` when the middle
    /// of the box lies beyond the lens image.
    pub fn from_crop_box(crop_box: [f64; 4], crop: &FrameCrop, lens: &Lens) -> Option<Self> {
        let frame_box @ [x_min, y_min, x_max, y_max] = crop.frame_box(crop_box);
        let center = middle(frame_box);
        let half = Vector2::new(x_max - x_min, y_max - y_min) / 2.0;
        let ray = |point: &Pixel| {
            let pixel = to_pixel_center(*point);
            lens.unproject(&pixel)
        };
        ray(&center)?;
        let outline = ELLIPSE_ANGLES
            .map(|(sin, cos)| center + Vector2::new(half.x * sin, -half.y * cos))
            .to_vec();
        let rays = outline.iter().step_by(RAY_STRIDE).filter_map(ray).collect();
        Some(Self {
            outline,
            rays,
            extremities: None,
        })
    }

    /// The footprint of a box found in the frame itself: its corners.
    pub fn from_frame_box(frame_box: [f64; 4]) -> Self {
        Self {
            outline: corners(frame_box).to_vec(),
            rays: Vec::new(),
            extremities: None,
        }
    }

    /// The axis-parallel hull `[x_min, y_min, x_max, y_max]`, corner-origin frame pixels.
    pub fn bounds(&self) -> [f64; 4] {
        let first = self.outline[0];
        let points = self.outline.iter().map(|at| [at.x, at.y, at.x, at.y]);
        points.fold([first.x, first.y, first.x, first.y], hull)
    }
}

fn corners([x_min, y_min, x_max, y_max]: [f64; 4]) -> [Pixel; 4] {
    [
        Pixel::new(x_min, y_min),
        Pixel::new(x_max, y_min),
        Pixel::new(x_max, y_max),
        Pixel::new(x_min, y_max),
    ]
}

/// The ray (camera frame) through a point of a view (corner-origin pixels).
fn ray_through(point: Pixel, view: &VirtualView) -> Ray {
    view.ray_in_camera(&to_pixel_center(point))
}

/// An ellipse in the plane of a view, as rays (camera frame).
struct Ellipse {
    center: Ray,
    /// From the center along the vertical to the outline.
    to_head: Ray,
    /// From the center to the right, across the vertical, to the outline.
    to_right: Ray,
}

impl Ellipse {
    /// The ellipse inscribed in a box (corner-origin view pixels) whose major axis lies along the
    /// projected vertical.
    fn inscribed(
        [x_min, y_min, x_max, y_max]: [f64; 4],
        view: &VirtualView,
        mount: &Mount,
    ) -> Self {
        let center = Pixel::new(f64::midpoint(x_min, x_max), f64::midpoint(y_min, y_max));
        let half_width = (x_max - x_min) / 2.0;
        let half_height = (y_max - y_min) / 2.0;
        let center_pixel = to_pixel_center(center);
        let (up, along, across) = view
            .vertical_at(&center_pixel, mount)
            .and_then(|vertical| ellipse_axes(vertical, half_width, half_height))
            .unwrap_or((-Vector2::y(), half_height, half_width));
        let right = Vector2::new(-up.y, up.x);
        let ray = view.ray_in_camera(&center_pixel);
        // Rays through the plane of a view are an affine function of its pixels.
        Self {
            center: ray,
            to_head: ray_through(center + up * along, view) - ray,
            to_right: ray_through(center + right * across, view) - ray,
        }
    }

    /// Points from the head on, clockwise.
    fn outline(&self) -> [Ray; ELLIPSE_POINTS] {
        ELLIPSE_ANGLES.map(|(sin, cos)| self.center + self.to_head * cos + self.to_right * sin)
    }

    fn extremities(&self) -> Extremities {
        Extremities {
            head: self.center + self.to_head,
            right: self.center + self.to_right,
            foot: self.center - self.to_head,
            left: self.center - self.to_right,
        }
    }
}

/// The semi-axes (along and across `vertical`) of the ellipse inscribed in a box.
///
/// An ellipse with semi-axes `p` along `(sx, sy)` and `q` across has the half extents
/// `w² = p² sx² + q² sy²` and `h² = p² sy² + q² sx²`; this is their inverse.
fn ellipse_axes(
    vertical: Vector2<f64>,
    half_width: f64,
    half_height: f64,
) -> Option<(Vector2<f64>, f64, f64)> {
    let (sx2, sy2) = (vertical.x * vertical.x, vertical.y * vertical.y);
    // sy⁴ − sx⁴ with sx² + sy² = 1.
    let determinant = sy2 - sx2;
    if determinant.abs() < MIN_TILT_DETERMINANT {
        return None;
    }
    let (w2, h2) = (half_width * half_width, half_height * half_height);
    let along2 = (h2 * sy2 - w2 * sx2) / determinant;
    let across2 = (w2 * sy2 - h2 * sx2) / determinant;
    let plausible = along2 > 0.0 && across2 > MIN_SQUARED_AXIS_RATIO * along2;
    plausible.then(|| (vertical, along2.sqrt(), across2.sqrt()))
}

#[cfg(test)]
mod tests;
