//! The zones, lines, masks, areas and ignored places of a calibration, checked.

use std::collections::BTreeSet;

use lookdown_lens::geometry::{
    CountingLine, FootFilter, LineEnds, Mount, Polygon, Zone, ZoneArea,
    foot_filter::MARGIN_OF_FRAME, polygon::Edge,
};
use nalgebra::Point2;

use crate::{
    FormatError,
    formats::Camera,
    id::check_name,
    native::{NativeImage, NativeLine, NativeLying, NativePlace},
};

/// Most zones of a calibration, most lines, most masks, most areas and most ignored places.
const MAX_AREAS: usize = 32;

/// Least extent of an area in the frame, pixels: a smaller one is in fractions of the frame.
const LEAST_PX: f64 = 4.0;
/// Least extent of an area on the floor, meters.
const LEAST_M: f64 = 0.05;

/// Areas that are drawn into the frames or onto the floor of a camera.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Areas {
    /// Areas in which persons are counted; their names differ.
    pub zones: Vec<Zone>,
    /// Lines over which persons are counted; their names differ.
    pub lines: Vec<CountingLine>,
    /// Areas that are blanked before detection, corner-origin frame pixels.
    pub masks: Vec<Polygon>,
    /// The places of people who count.
    pub foot_filter: FootFilter,
}

/// The share of the frame that an area covers.
#[derive(Debug, Clone, PartialEq)]
pub struct AreaShare {
    /// The field, such as `masks[0]`.
    pub field: String,
    /// The share, percent.
    pub percent: f64,
}

impl Areas {
    /// Checks the areas of a camera for frames of the size `image`.
    pub(super) fn checked(
        camera: &Camera,
        image: NativeImage,
        mount: &Mount,
    ) -> Result<Self, FormatError> {
        let Camera {
            zones,
            lines,
            masks,
            areas,
            ignore,
            ..
        } = camera;
        at_most("zones", zones.len())?;
        at_most("lines", lines.len())?;
        at_most("masks", masks.len())?;
        at_most("areas", areas.len())?;
        at_most("ignore", ignore.len())?;
        let mut names = BTreeSet::new();
        let zones = zones.iter().enumerate().map(|(index, zone)| {
            let field = format!("zones[{index}]");
            check_name(&format!("{field}.name"), &zone.name)?;
            if !names.insert(&zone.name) {
                let problem = format!("another zone is called {:?}, too: rename one", zone.name);
                return Err(FormatError::invalid(format!("{field}.name"), problem));
            }
            Ok(Zone {
                name: zone.name.clone(),
                area: area(&field, (&zone.frame_px, &zone.floor_m), image, mount)?,
                is_lying_expected: zone.lying == Some(NativeLying::Expected),
            })
        });
        let zones = zones.collect::<Result<_, _>>()?;
        let lines = checked_lines(lines, image, mount)?;
        let masks = masks.iter().enumerate().map(|(index, mask)| {
            let field = format!("masks[{index}].frame_px");
            frame_polygon(&field, &mask.frame_px, image)
        });
        Ok(Self {
            zones,
            lines,
            masks: masks.collect::<Result<_, _>>()?,
            foot_filter: FootFilter {
                areas: places("areas", areas, image, mount)?,
                ignore: places("ignore", ignore, image, mount)?,
                margin_px: MARGIN_OF_FRAME * f64::from(image.width),
            },
        })
    }

    /// Returns the zones, masks, areas and ignored places in the frame with the share of a frame of
    /// `width` × `height` pixels that each covers.
    pub fn shares(&self, width: u32, height: u32) -> Vec<AreaShare> {
        fn in_frame(area: &ZoneArea) -> Option<&Polygon> {
            match area {
                ZoneArea::Frame(polygon) => Some(polygon),
                ZoneArea::Floor(_) => None,
            }
        }
        let zones = self.zones.iter().map(|zone| in_frame(&zone.area));
        let lists: [(&str, Vec<_>); 4] = [
            ("zones", zones.collect()),
            ("masks", self.masks.iter().map(Some).collect()),
            (
                "areas",
                self.foot_filter.areas.iter().map(in_frame).collect(),
            ),
            (
                "ignore",
                self.foot_filter.ignore.iter().map(in_frame).collect(),
            ),
        ];
        let shares = lists.into_iter().flat_map(|(of, polygons)| {
            let polygons = polygons.into_iter().enumerate();
            polygons.filter_map(move |(index, polygon)| {
                Some(AreaShare {
                    field: format!("{of}[{index}]"),
                    percent: 100.0 * polygon?.share_of_frame(width, height),
                })
            })
        });
        shares.collect()
    }

    /// The same areas in frames `scale_x`, `scale_y` times as large.
    pub fn scaled(&self, scale_x: f64, scale_y: f64) -> Self {
        let (zones, lines, masks) = (self.zones.iter(), self.lines.iter(), self.masks.iter());
        Self {
            lines: lines.map(|line| line.scaled(scale_x, scale_y)).collect(),
            zones: zones.map(|zone| zone.scaled(scale_x, scale_y)).collect(),
            masks: masks.map(|mask| mask.scaled(scale_x, scale_y)).collect(),
            foot_filter: self.foot_filter.scaled(scale_x, scale_y),
        }
    }
}

fn at_most(field: &str, count: usize) -> Result<(), FormatError> {
    if count <= MAX_AREAS {
        return Ok(());
    }
    let problem = format!("there are {count}: a calibration may have {MAX_AREAS}");
    Err(FormatError::invalid(field, problem))
}

/// Checks areas or ignored places of the field `of`.
fn places(
    of: &str,
    places: &[NativePlace],
    image: NativeImage,
    mount: &Mount,
) -> Result<Vec<ZoneArea>, FormatError> {
    let checked = places.iter().enumerate().map(|(index, place)| {
        let field = format!("{of}[{index}]");
        if let Some(name) = &place.name {
            check_name(&format!("{field}.name"), name)?;
        }
        area(&field, (&place.frame_px, &place.floor_m), image, mount)
    });
    checked.collect()
}

/// Corners in the frame, and corners on the floor.
type Corners<'a> = (&'a Option<Vec<[f64; 2]>>, &'a Option<Vec<[f64; 2]>>);

fn area(
    field: &str,
    corners: Corners<'_>,
    image: NativeImage,
    mount: &Mount,
) -> Result<ZoneArea, FormatError> {
    match corners {
        (Some(corners), None) => {
            let field = format!("{field}.frame_px");
            Ok(ZoneArea::Frame(frame_polygon(&field, corners, image)?))
        }
        (None, Some(corners)) => {
            let field = format!("{field}.floor_m");
            if mount.height_m().is_none() {
                let problem = "where the floor is follows from the camera's height: give \
                               mount.height_m, or draw the area in the frame with frame_px";
                return Err(FormatError::invalid(field, problem));
            }
            let area = polygon(&field, corners)?;
            let size = area.extent();
            if size.max() < LEAST_M {
                let problem = format!("it is {} × {} m small: give meters", size.x, size.y);
                return Err(FormatError::invalid(field, problem));
            }
            Ok(ZoneArea::Floor(area))
        }
        (Some(_), Some(_)) => Err(FormatError::invalid(
            field,
            "it has both frame_px and floor_m: leave one out, or make two areas",
        )),
        (None, None) => Err(FormatError::invalid(
            field,
            "it has no corners: give frame_px in pixels of the frame, or floor_m in meters on the \
             floor",
        )),
    }
}

fn frame_polygon(
    field: &str,
    corners: &[[f64; 2]],
    image: NativeImage,
) -> Result<Polygon, FormatError> {
    let NativeImage { width, height } = image;
    let polygon = polygon(field, corners)?;
    if polygon.extent().max() < LEAST_PX {
        return Err(FormatError::invalid(field, too_small(&polygon, image)));
    }
    if polygon.meets(&Polygon::for_frame(width, height)) {
        return Ok(polygon);
    }
    let problem = format!(
        "it lies wholly outside the frame of {width}×{height} pixels: give pixels of frames of that \
         size"
    );
    Err(FormatError::invalid(field, problem))
}

/// The problem of a polygon that covers nothing.
fn too_small(polygon: &Polygon, NativeImage { width, height }: NativeImage) -> String {
    let numbers = polygon
        .corners()
        .iter()
        .flat_map(|corner| [corner.x, corner.y]);
    let least = numbers.clone().fold(f64::INFINITY, f64::min);
    let most = numbers.fold(f64::NEG_INFINITY, f64::max);
    if least < 0.0 || most > 1.0 {
        let size = polygon.extent();
        return format!(
            "it is {} × {} pixels small: give pixels of frames of {width}×{height}",
            size.x, size.y
        );
    }
    let [from, to] = [least, most].map(|number| (number * f64::from(width)).round());
    format!(
        "its corners are {least} to {most}, which look like fractions of the frame: give pixels, \
         here {from} to {to}"
    )
}

fn polygon(field: &str, corners: &[[f64; 2]]) -> Result<Polygon, FormatError> {
    Polygon::new(corners).map_err(|error| FormatError::invalid(field, error.to_string()))
}

/// Shortest line on the floor, meters, and in the frame, pixels.
const SHORTEST_M: f64 = 0.1;
const SHORTEST_PX: f64 = 4.0;
/// Farthest coordinate on the floor, meters.
const MAX_FLOOR_M: f64 = 1000.0;

fn checked_lines(
    lines: &[NativeLine],
    image: NativeImage,
    mount: &Mount,
) -> Result<Vec<CountingLine>, FormatError> {
    let mut names = BTreeSet::new();
    let lines = lines.iter().enumerate().map(|(index, line)| {
        let field = format!("lines[{index}]");
        check_name(&format!("{field}.name"), &line.name)?;
        if !names.insert(&line.name) {
            let problem = format!("another line has the name {:?}: rename one", line.name);
            return Err(FormatError::invalid(format!("{field}.name"), problem));
        }
        for (index, direction) in line.directions.iter().enumerate() {
            check_name(&format!("{field}.directions[{index}]"), direction)?;
        }
        let [one, other] = &line.directions;
        if one == other {
            let problem = format!("both are {one:?}: give the two directions different names");
            return Err(FormatError::invalid(format!("{field}.directions"), problem));
        }
        Ok(CountingLine {
            name: line.name.clone(),
            ends: line_ends(&field, line, image, mount)?,
            directions: line.directions.clone(),
        })
    });
    lines.collect()
}

fn line_ends(
    field: &str,
    line: &NativeLine,
    image: NativeImage,
    mount: &Mount,
) -> Result<LineEnds, FormatError> {
    let problem = match (&line.frame_px, &line.floor_m) {
        (Some(ends), None) => return in_frame(&format!("{field}.frame_px"), ends, image),
        (None, Some(ends)) => {
            let field = format!("{field}.floor_m");
            if mount.height_m().is_none() {
                let problem = "the floor needs the camera's height: give mount.height_m, or draw \
                               the line in the frame with frame_px";
                return Err(FormatError::invalid(field, problem));
            }
            return two_ends(&field, ends, SHORTEST_M, MAX_FLOOR_M, "meters").map(LineEnds::Floor);
        }
        (Some(_), Some(_)) => "it has both frame_px and floor_m: leave one out",
        (None, None) => {
            "it has no ends: give two points as frame_px in pixels of the frame, or as floor_m in \
             meters on the floor"
        }
    };
    Err(FormatError::invalid(field, problem))
}

fn in_frame(
    field: &str,
    ends: &[[f64; 2]],
    NativeImage { width, height }: NativeImage,
) -> Result<LineEnds, FormatError> {
    let farthest = 2.0 * f64::from(width.max(height));
    let ends = two_ends(field, ends, SHORTEST_PX, farthest, "pixels")?;
    let frame = Polygon::for_frame(width, height);
    if frame.holds(ends[0]) || frame.holds(ends[1]) {
        return Ok(LineEnds::Frame(ends));
    }
    let problem = format!(
        "both ends are outside the frame of {width}×{height} pixels: give pixels of frames of \
         that size"
    );
    Err(FormatError::invalid(field, problem))
}

fn two_ends(
    field: &str,
    ends: &[[f64; 2]],
    shortest: f64,
    farthest: f64,
    unit: &str,
) -> Result<Edge, FormatError> {
    let &[from, to] = ends else {
        let problem = format!("it has {} points: give the two ends [x, y]", ends.len());
        return Err(FormatError::invalid(field, problem));
    };
    for [x, y] in [from, to] {
        let is_near = |value: f64| value.abs() <= farthest;
        if !(is_near(x) && is_near(y)) {
            let problem =
                format!("an end is [{x}, {y}]: give numbers from -{farthest} to {farthest} {unit}");
            return Err(FormatError::invalid(field, problem));
        }
    }
    let ends = [from, to].map(Point2::from);
    let length = (ends[1] - ends[0]).norm();
    if length < shortest {
        let problem =
            format!("it is {length} {unit} long: give ends at least {shortest} {unit} apart");
        return Err(FormatError::invalid(field, problem));
    }
    Ok(ends)
}

#[cfg(test)]
mod tests;
