//! `OCamCalib`'s `calib_results.txt` (Scaramuzza, <https://sites.google.com/site/scarabotix>):
//! blocks of numbers, each after a `#` comment that says what it is.
//!
//! Its x axis runs down the rows: the center is row, then column (counted from 0), the size is
//! height, then width. The polynomials are preceded by their count. The inverse polynomial is an
//! approximation and not used.
//!
//! py-OCamCalib's JSON (<https://github.com/jakarto3d/py-OCamCalib>): Scaramuzza's model with x
//! along the columns and z out of the lens, so the polynomial has the opposite sign of
//! `OCamCalib`'s.
//!
//! It has no frame size. Its `world2cam` applies `e` to the stretched x; the stretch
//! matrix is meant as it is written, which is what its `cam2world` inverts.

use lookdown_lens::geometry::lens::Ocam;

use super::{
    Camera, FormatError,
    column_first::ColumnFirst,
    fields::{self, Fields, whole_pixels},
};
use crate::native::NativeImage;

/// Names of the blocks, in the file's order.
const BLOCKS: [&str; 5] = [
    "direct polynomial",
    "inverse polynomial",
    "center",
    "affine parameters",
    "image size",
];

pub(super) fn read(text: &str) -> Result<Camera, FormatError> {
    let blocks = text
        .lines()
        .map(str::trim)
        .filter(|line| !(line.is_empty() || line.starts_with('#')));
    let blocks: Vec<&str> = blocks.collect();
    let [direct, _inverse, center, affine, image] = blocks[..] else {
        return Err(FormatError::malformed(format!(
            "OCamCalib's text has {} lines of numbers: 5 are needed ({})",
            blocks.len(),
            BLOCKS.join(", ")
        )));
    };
    let direct = numbers(BLOCKS[0], direct)?;
    let polynomial = match &direct[..] {
        [count, coefficients @ ..] if counts(*count, coefficients) => coefficients.to_vec(),
        _ => {
            return Err(FormatError::invalid(
                BLOCKS[0],
                "its first number must be the count of the coefficients after it",
            ));
        }
    };
    let [row, column] = exactly(BLOCKS[2], center, "row and column")?;
    let [c, d, e] = exactly(BLOCKS[3], affine, "c, d and e")?;
    let [height, width] = exactly(BLOCKS[4], image, "height and width")?;
    let side =
        |pixels| fields::side(pixels).map_err(|problem| FormatError::invalid(BLOCKS[4], problem));
    let image = NativeImage {
        width: side(width)?,
        height: side(height)?,
    };
    let lens = Ocam {
        c,
        d,
        e,
        ..Ocam::new(polynomial, [column, row])
    };
    Ok(Camera::new(Some(image), lens))
}

fn counts(count: f64, coefficients: &[f64]) -> bool {
    whole_pixels(count).is_some_and(|count| count as usize == coefficients.len())
}

fn numbers(block: &'static str, line: &str) -> Result<Vec<f64>, FormatError> {
    line.split_whitespace()
        .map(|word| {
            word.parse().map_err(|_| {
                let word: String = word.chars().take(40).collect();
                FormatError::invalid(block, format!("{word:?} is not a number"))
            })
        })
        .collect()
}

fn exactly<const N: usize>(
    block: &'static str,
    line: &str,
    expected: &str,
) -> Result<[f64; N], FormatError> {
    let numbers = numbers(block, line)?;
    fields::exactly(numbers, expected).map_err(|problem| FormatError::invalid(block, problem))
}

/// Reads a file of `py-OCamCalib`.
pub(super) fn read_python(fields: &Fields<'_>) -> Result<Camera, FormatError> {
    let polynomial = fields.numbers("taylor_coefficient")?;
    let lens = ColumnFirst::read(fields, ["distortion_center", "stretch_matrix"], &polynomial)?;
    Ok(Camera::new(None, lens.into_lens()?))
}
