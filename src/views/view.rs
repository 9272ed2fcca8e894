//! A straight view as it is stored: its values, their checks, and its parts in the camera frame.

use std::{
    f64::consts::{FRAC_PI_2, PI, TAU},
    ops::RangeInclusive,
};

use lookdown_calibration::CameraGeometry;
use lookdown_detect::parameters::ParameterError;
use lookdown_imaging::annotate::ZoneOutline;
use lookdown_lens::geometry::{
    Mount, OrientedBox, Panorama, Pixel, VirtualView,
    pixels::{to_corner_origin, to_pixel_center},
};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Sides of a view, pixels: a wall of screens is not wider.
const SIDES: RangeInclusive<f64> = 64.0..=4096.0;
/// Most pixels of a view.
const MAX_PIXELS: u32 = 4096 * 1024;
/// A turn in both directions.
const AZIMUTHS_DEG: RangeInclusive<f64> = -360.0..=360.0;
/// A perspective image stretches its corners by 15 at 150°.
const FIELDS_OF_VIEW_DEG: RangeInclusive<f64> = 10.0..=150.0;
/// From straight down to the horizon.
const TILTS_DEG: RangeInclusive<f64> = 0.0..=90.0;
/// The upper border of a panorama, from straight down: rooms show nothing above it but the ceiling.
const PANORAMA_TILT: f64 = 85.0 * PI / 180.0;
/// Proportions of a panorama from which on all of it is one strip. A narrower one is two strips of
/// half a turn, which show people twice as large.
const ONE_STRIP: f64 = 1.5;
/// The quarters begin near the nadir and end near the horizon.
const QUARTER_TILT_DEG: f64 = 50.0;
/// Points along each side of a box that is projected into a view.
const BOX_STEPS: u32 = 4;
/// Points between two of an outline: it ends within a 16th of their distance at a border.
const LINE_STEPS: u32 = 16;

/// The kinds of views.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ViewKind {
    /// One direction.
    #[default]
    Fixed,
    /// The ring around the camera, unrolled: one strip of 360°, or two of 180° below a proportion
    /// of 3:2.
    Panorama,
    /// Four directions, 90° apart.
    Quarters,
    /// A person: the newest arrival while it is there, then who is left. The axis turns smoothly.
    Follow,
}

/// A straight view of a camera.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
#[schema(example = json!({ "azimuth_deg": 90, "tilt_deg": 50, "field_of_view_deg": 80 }))]
pub struct View {
    /// The name, in lists; in a body it is ignored.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(example = "door")]
    pub name: Option<String>,
    /// The kind.
    pub kind: ViewKind,
    /// Direction of the middle of the view, or of its first quarter: 0 toward image right,
    /// clockwise on the screen, degrees. `follow` begins there.
    pub azimuth_deg: f64,
    /// Angle of the axis from straight down, degrees; 45 by default, 50 for `quarters`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 0, maximum = 90)]
    pub tilt_deg: Option<f64>,
    /// Horizontal field of view, degrees; 90 by default. `follow` adapts it to the person.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 10, maximum = 150)]
    pub field_of_view_deg: Option<f64>,
    /// Width, pixels.
    #[schema(minimum = 64, maximum = 4096)]
    pub width: u32,
    /// Height, pixels.
    #[schema(minimum = 64, maximum = 4096)]
    pub height: u32,
}

impl Default for View {
    fn default() -> Self {
        Self {
            name: None,
            kind: ViewKind::Fixed,
            azimuth_deg: 0.0,
            tilt_deg: None,
            field_of_view_deg: None,
            width: 960,
            height: 720,
        }
    }
}

/// The direction and the width of a view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Direction {
    /// 0 toward image right, clockwise on the screen, radians.
    pub(super) azimuth: f64,
    /// From straight down, radians.
    pub(super) tilt: f64,
    /// Horizontal, radians.
    pub(super) field_of_view: f64,
}

/// A rectangle of a view, and its rays.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Part {
    /// Left and upper border in the view, pixels.
    pub(super) origin: [u32; 2],
    pub(super) projection: Projection,
}

/// The rays of a part.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Projection {
    Pinhole(VirtualView),
    Panorama(Panorama),
}

impl View {
    /// Checks the values.
    ///
    /// # Errors
    /// [`ParameterError`] with the field, its value and its range.
    pub fn check(&self) -> Result<(), ParameterError> {
        let [width, height] = [self.width, self.height].map(f64::from);
        for (name, value, range, unit) in [
            ("width", Some(width), SIDES, "pixels"),
            ("height", Some(height), SIDES, "pixels"),
            (
                "azimuth_deg",
                Some(self.azimuth_deg),
                AZIMUTHS_DEG,
                "degrees",
            ),
            (
                "tilt_deg",
                self.tilt_deg,
                TILTS_DEG,
                "degrees from straight down",
            ),
            (
                "field_of_view_deg",
                self.field_of_view_deg,
                FIELDS_OF_VIEW_DEG,
                "degrees",
            ),
        ] {
            let (least, most) = (range.start(), range.end());
            if let Some(value) = value.filter(|value| !range.contains(value)) {
                let problem = format!("{value} is not {least} to {most} {unit}");
                return Err(ParameterError::bad_value(name, problem));
            }
        }
        if self.width * self.height > MAX_PIXELS {
            let problem =
                format!("{width} × {height} are more than {MAX_PIXELS} pixels: lower one");
            return Err(ParameterError::bad_value("width", problem));
        }
        Ok(())
    }

    /// The direction of the view, or of its first part.
    pub(super) fn direction(&self) -> Direction {
        let tilt_deg = match self.kind {
            ViewKind::Quarters => QUARTER_TILT_DEG,
            _ => 45.0,
        };
        Direction {
            azimuth: self.azimuth_deg.to_radians(),
            tilt: self.tilt_deg.unwrap_or(tilt_deg).to_radians(),
            field_of_view: self.field_of_view_deg.unwrap_or(90.0).to_radians(),
        }
    }

    /// The parts in the frames of a camera. `direction` replaces that of the view.
    ///
    /// # Errors
    /// [`ParameterError`] if the axis of a part is outside of the lens image.
    pub(super) fn parts(
        &self,
        direction: &Direction,
        camera: &CameraGeometry,
    ) -> Result<Vec<Part>, ParameterError> {
        let mount = &camera.mount;
        let pinhole = |turn: f64, width, height| {
            let azimuth = direction.azimuth + turn;
            let (tilt, field_of_view) = (direction.tilt, direction.field_of_view);
            let view = VirtualView::leveled(azimuth, tilt, field_of_view, mount, width, height);
            Projection::Pinhole(view)
        };
        let whole = |projection| Part {
            origin: [0, 0],
            projection,
        };
        let (width, height) = (self.width, self.height);
        let parts = match self.kind {
            ViewKind::Fixed | ViewKind::Follow => vec![whole(pinhole(0.0, width, height))],
            ViewKind::Quarters => (0..4_u32)
                .map(|quarter| {
                    let [column, row] = [quarter % 2, quarter / 2];
                    let turn = f64::from(quarter) * FRAC_PI_2;
                    Part {
                        origin: [column * (width / 2), row * (height / 2)],
                        projection: pinhole(turn, width / 2, height / 2),
                    }
                })
                .collect(),
            ViewKind::Panorama => self.strips(direction.azimuth, camera.lens.max_theta(), mount),
        };
        let sees = |part: &Part| match &part.projection {
            Projection::Pinhole(view) => {
                let axis = view.ray_in_camera(&view.principal_point());
                camera.lens.project(&axis).is_some()
            }
            Projection::Panorama(_) => true,
        };
        if parts.iter().all(sees) {
            return Ok(parts);
        }
        let end = camera.lens.max_theta().to_degrees();
        let tilt = direction.tilt.to_degrees();
        let problem = format!(
            "the axis of the view is beyond the lens image at {tilt:.0}: the lens ends {end:.0}° off its axis, \
             choose a smaller tilt_deg"
        );
        Err(ParameterError::bad_value("tilt_deg", problem))
    }

    /// The strips of a panorama.
    fn strips(&self, azimuth: f64, max_theta: f64, mount: &Mount) -> Vec<Part> {
        let is_one = f64::from(self.width) >= ONE_STRIP * f64::from(self.height);
        let count = if is_one { 1 } else { 2 };
        let height = self.height / count;
        let span = TAU / f64::from(count);
        let tilt = PANORAMA_TILT.min(max_theta);
        let strip = |index: u32| Part {
            origin: [0, index * height],
            projection: Projection::Panorama(Panorama::new(
                azimuth + f64::from(index) * span,
                span,
                tilt,
                mount,
                self.width,
                height,
            )),
        };
        (0..count).map(strip).collect()
    }
}

impl Part {
    /// Width and height, pixels.
    pub(super) fn size(&self) -> [u32; 2] {
        match &self.projection {
            Projection::Pinhole(view) => [view.width, view.height],
            Projection::Panorama(panorama) => [panorama.width, panorama.height],
        }
    }

    /// Left, top, right and bottom in the view, pixels.
    fn borders(&self) -> [f64; 4] {
        let ([left, top], [width, height]) = (self.origin, self.size());
        [left, top, left + width, top + height].map(f64::from)
    }

    /// The point of the view at which the part shows a point of the frame, possibly beyond its
    /// borders; both in corner-origin pixels.
    fn project(&self, point: Pixel, camera: &CameraGeometry) -> Option<Pixel> {
        let pixel = to_pixel_center(point);
        let ray = camera.lens.unproject(&pixel)?;
        let point = match &self.projection {
            Projection::Pinhole(view) => view.project(&ray),
            Projection::Panorama(panorama) => panorama.project(&ray),
        };
        let point = to_corner_origin(point?);
        let [left, top] = self.origin.map(f64::from);
        Some(Pixel::new(point.x + left, point.y + top))
    }

    /// The point at which the part shows a point of the frame, within its borders.
    pub(super) fn shown(&self, point: Pixel, camera: &CameraGeometry) -> Option<Pixel> {
        let [left, top, right, bottom] = self.borders();
        let is_inside =
            |at: &Pixel| (left..=right).contains(&at.x) && (top..=bottom).contains(&at.y);
        self.project(point, camera).filter(is_inside)
    }

    /// The pieces of a line of the frame that the part shows. All points are corner-origin pixels.
    fn pieces(&self, line: &[[f64; 2]], camera: &CameraGeometry) -> Vec<Vec<[f64; 2]>> {
        let mut pieces = vec![Vec::<[f64; 2]>::new()];
        for ends in line.windows(2) {
            let [from, to] = [ends[0], ends[1]].map(Pixel::from);
            for step in 0..=LINE_STEPS {
                let share = f64::from(step) / f64::from(LINE_STEPS);
                let at = self.shown(from + (to - from) * share, camera);
                let last = pieces.last().and_then(|piece| piece.last());
                // The ends of a panorama are neighbors.
                let jump = f64::from(self.size()[0]) / 2.0;
                let is_cut = |at: Pixel| last.is_some_and(|last| (last[0] - at.x).abs() > jump);
                if at.is_none_or(is_cut) {
                    pieces.push(Vec::new());
                }
                if let (Some(at), Some(piece)) = (at, pieces.last_mut()) {
                    piece.push([at.x, at.y]);
                }
            }
        }
        pieces.retain(|piece| piece.len() > 1);
        pieces
    }
}

/// Returns the outlines in the frame as the parts show them.
pub(super) fn outlines_in_view(
    parts: &[Part],
    outlines: &[ZoneOutline],
    camera: &CameraGeometry,
) -> Vec<ZoneOutline> {
    let shown = parts.iter().flat_map(|part| {
        outlines.iter().map(|outline| ZoneOutline {
            name: outline.name.clone(),
            lines: outline
                .lines
                .iter()
                .flat_map(|line| part.pieces(line, camera))
                .collect(),
        })
    });
    shown.collect()
}

/// Returns the box of a person in a view: left, top, right and bottom, corner-origin pixels. `None`
/// if the center of the person is in no part.
pub(super) fn box_in_view(
    parts: &[Part],
    person: &OrientedBox,
    camera: &CameraGeometry,
) -> Option<[f64; 4]> {
    let mut shown = parts.iter();
    let (part, center) = shown.find_map(|part| Some((part, part.shown(person.center, camera)?)))?;
    let [left, top, right, bottom] = part.borders();
    let corners = person.corners();
    let mut found = [right, bottom, left, top];
    for (index, corner) in corners.iter().enumerate() {
        let next = corners[(index + 1) % 4];
        for step in 0..BOX_STEPS {
            let share = f64::from(step) / f64::from(BOX_STEPS);
            // The rim cuts off boxes there.
            let Some(mut at) = part.project(corner + (next - corner) * share, camera) else {
                continue;
            };
            if let Projection::Panorama(panorama) = &part.projection {
                // The ends of a panorama are neighbors.
                at.x -= panorama.turn() * ((at.x - center.x) / panorama.turn()).round();
            }
            found = [
                found[0].min(at.x.max(left)),
                found[1].min(at.y.max(top)),
                found[2].max(at.x.min(right)),
                found[3].max(at.y.min(bottom)),
            ];
        }
    }
    (found[0] < found[2] && found[1] < found[3]).then_some(found)
}
