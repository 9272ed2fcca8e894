//! The lines of a calibration, checked.

use std::collections::BTreeSet;

use nalgebra::Point2;

use super::area_name::check_name;
use crate::FormatError;
use crate::native::{NativeImage, NativeLine};
use lookdown_lens::geometry::{CountingLine, LineEnds, Mount, Polygon, polygon::Edge};

/// Shortest line on the floor, meters, and in the frame, pixels.
const SHORTEST_M: f64 = 0.1;
const SHORTEST_PX: f64 = 4.0;
/// Farthest coordinate on the floor, meters.
const MAX_FLOOR_M: f64 = 1000.0;

pub(super) fn checked(
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
