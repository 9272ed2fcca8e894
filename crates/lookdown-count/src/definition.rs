//! The settings of a camera's calibration that counting needs: lines, zones, and the place on a
//! site.

use lookdown_calibration::{Calibration, CameraGeometry};
use lookdown_lens::geometry::{
    CountingLine, LineEnds, Pixel, Polygon, ZoneArea,
    floor::{FloorPosition, floor_position, pixel_of},
    oriented_box::vertical_in_frame,
    polygon::MAX_CORNERS,
};
use lookdown_tracking::{
    CameraPose, Plane,
    lines::{DEFAULT_BAND_M, Line},
    zones::Zone,
};
use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

/// Half the width of the hysteresis band of a line in the frame, as a share of the frame's width.
const BAND_OF_FRAME: f64 = 0.02;

/// The lines and zones of a camera, and its place.
#[derive(Debug, Clone)]
pub(crate) struct CameraDefinition {
    pub(crate) key: DefinitionKey,
    /// The camera for frames of the report's size; `None` without a calibration.
    pub(crate) geometry: Option<CameraGeometry>,
    /// The site that the camera is part of.
    pub(crate) site: Option<String>,
    /// Its place on the site, or at the origin of its own floor.
    pub(crate) pose: CameraPose,
    /// The lines in the plane of the tracker.
    pub(crate) lines: Vec<Line>,
    /// The names of the two directions of each line.
    pub(crate) directions: Vec<[String; 2]>,
    /// The zones in the plane of the tracker.
    pub(crate) zones: Vec<Zone>,
    /// The areas of the calibration on the floor of the site; none for a camera alone.
    pub(crate) areas: Vec<Polygon>,
}

impl CameraDefinition {
    /// Returns the definition of a camera without a calibration: nothing but persons is counted.
    pub(crate) fn without_calibration(key: DefinitionKey) -> Self {
        Self {
            key,
            geometry: None,
            site: None,
            pose: CameraPose::alone(None),
            lines: Vec::new(),
            directions: Vec::new(),
            zones: Vec::new(),
            areas: Vec::new(),
        }
    }

    #[cfg(test)]
    pub(crate) fn unknown() -> Self {
        Self::without_calibration(DefinitionKey {
            calibration: None,
            revision: String::new(),
            width: 200,
            height: 200,
        })
    }

    /// Returns the definition of a calibration. Lines and zones that cannot be placed on the floor
    /// of a site are logged and left out.
    pub(crate) fn new(key: DefinitionKey, calibration: &Calibration) -> Self {
        let Ok(geometry) = calibration.for_frame(key.width, key.height) else {
            return Self::without_calibration(key);
        };
        let height_m = geometry.mount.height_m();
        let placement = calibration.site();
        let pose = placement.map_or_else(
            || CameraPose::alone(height_m),
            |placement| CameraPose {
                position_m: placement.position_m,
                yaw_deg: placement.yaw_deg,
                height_m,
            },
        );
        let planes = Planes {
            geometry: &geometry,
            pose,
            is_on_site: placement.is_some(),
        };
        let id = calibration.id().as_str();
        let warn_unless = |is_placed: bool, kind: &str, name: &str| {
            if !is_placed {
                tracing::warn!(
                    "calibration {id}: the {kind} {name} is not on the floor of its site: draw it with floor_m"
                );
            }
        };
        let lines = geometry.areas.lines.iter();
        let (lines, directions) = lines
            .filter_map(|line| {
                let placed = planes.line(line, key.width);
                warn_unless(placed.is_some(), "line", &line.name);
                Some((placed?, line.directions.clone()))
            })
            .unzip();
        let zones = geometry.areas.zones.iter().filter_map(|zone| {
            let placed = planes.zone(&zone.area);
            warn_unless(placed.is_some(), "zone", &zone.name);
            let (plane, area) = placed?;
            let name = zone.name.clone();
            Some(Zone { name, plane, area })
        });
        let areas = geometry.areas.foot_filter.areas.iter();
        let areas = areas.filter_map(|area| Some(planes.zone(area)?.1));
        let areas = placement.map_or_else(Vec::new, |_| areas.collect());
        Self {
            areas,
            site: placement.map(|placement| placement.site.clone()),
            pose,
            lines,
            directions,
            zones: zones.collect(),
            key,
            geometry: Some(geometry),
        }
    }

    /// Returns true if another definition is for frames of the same size.
    pub(crate) fn has_frames_of(&self, other: &Self) -> bool {
        let size = |definition: &Self| (definition.key.width, definition.key.height);
        size(self) == size(other)
    }

    /// Returns the direction in the frame, at a pixel, of what is up.
    pub(crate) fn up_at(&self, pixel: Pixel) -> Vector2<f64> {
        if let Some(camera) = &self.geometry {
            return vertical_in_frame(pixel, &camera.lens, &camera.mount);
        }
        let (width, height) = (self.key.width, self.key.height);
        pixel - Pixel::new(f64::from(width) / 2.0, f64::from(height) / 2.0)
    }

    /// Returns the frame pixel of a place on the floor of the tracker; `None` where the lens does
    /// not see it.
    pub(crate) fn pixel_of(&self, floor_m: [f64; 2]) -> Option<[f64; 2]> {
        let geometry = self.geometry.as_ref()?;
        let [x_m, y_m] = self.pose.from_site(floor_m);
        let pixel = pixel_of(FloorPosition { x_m, y_m }, &geometry.lens, &geometry.mount)?;
        Some([pixel.x, pixel.y])
    }

    /// Returns the place on the floor of the tracker at a frame pixel; `None` where the lens does
    /// not see the floor.
    pub(crate) fn floor_at(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let geometry = self.geometry.as_ref()?;
        let floor = floor_position(Pixel::new(x, y), &geometry.lens, &geometry.mount)?;
        Some(self.pose.to_site([floor.x_m, floor.y_m]))
    }
}

/// Maps what is drawn in the frame or on the camera's floor to the plane of the tracker.
struct Planes<'a> {
    geometry: &'a CameraGeometry,
    pose: CameraPose,
    is_on_site: bool,
}

impl Planes<'_> {
    fn line(&self, line: &CountingLine, frame_width: u32) -> Option<Line> {
        let (plane, points) = match line.ends {
            LineEnds::Frame(ends) if !self.is_on_site => {
                (Plane::FramePx, ends.map(|end| [end.x, end.y]).to_vec())
            }
            LineEnds::Frame(ends) => {
                let points = ends.map(|end| self.floor_of(end));
                (Plane::FloorM, points.into_iter().collect::<Option<_>>()?)
            }
            LineEnds::Floor(ends) => {
                let points = ends.map(|end| self.pose.to_site([end.x, end.y]));
                (Plane::FloorM, points.to_vec())
            }
        };
        Some(Line {
            name: line.name.clone(),
            plane,
            points,
            band: match plane {
                Plane::FloorM => DEFAULT_BAND_M,
                Plane::FramePx => f64::from(frame_width) * BAND_OF_FRAME,
            },
        })
    }

    fn zone(&self, area: &ZoneArea) -> Option<(Plane, Polygon)> {
        match area {
            ZoneArea::Frame(area) if !self.is_on_site => Some((Plane::FramePx, area.clone())),
            ZoneArea::Frame(area) => {
                // Straight edges of the frame are curves on the floor.
                let per_edge = (MAX_CORNERS / area.corners().len()).clamp(1, 8);
                let points = area.edges().flat_map(|[from, to]| {
                    (0..per_edge).map(move |point| {
                        let share = point as f64 / per_edge as f64;
                        from + (to - from) * share
                    })
                });
                let corners: Option<Vec<_>> = points.map(|point| self.floor_of(point)).collect();
                let area = Polygon::new(&corners?).ok()?;
                Some((Plane::FloorM, area))
            }
            ZoneArea::Floor(area) => {
                let corners = area.corners().iter();
                let corners: Vec<_> = corners
                    .map(|corner| self.pose.to_site([corner.x, corner.y]))
                    .collect();
                Some((Plane::FloorM, Polygon::new(&corners).ok()?))
            }
        }
    }

    fn floor_of(&self, pixel: Pixel) -> Option<[f64; 2]> {
        let floor = floor_position(pixel, &self.geometry.lens, &self.geometry.mount)?;
        Some(self.pose.to_site([floor.x_m, floor.y_m]))
    }
}

/// The calibration and the frame size that a definition belongs to.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct DefinitionKey {
    /// The ID of the calibration; `None` without one.
    pub(crate) calibration: Option<String>,
    /// Its revision.
    pub(crate) revision: String,
    pub(crate) width: u32,
    pub(crate) height: u32,
}
