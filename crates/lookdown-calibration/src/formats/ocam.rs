//! Scaramuzza's model, which `OCamCalib` and programs after it store in several forms.

use lookdown_lens::geometry::lens::{KannalaBrandt, Ocam};
use serde_json::Value;

use super::{
    Camera, FormatError,
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

/// Most coefficients of a polynomial; real ones have five.
const MAX_COEFFICIENTS: f64 = 64.0;

/// The polynomial of MATLAB.
const POLYNOMIAL: &str = "MappingCoefficients";
/// The fields that mark a file of MATLAB.
pub(super) const MATLAB_FIELDS: [&str; 2] = [POLYNOMIAL, "DistortionCoefficients"];

/// `OCamCalib`'s `calib_results.txt` (Scaramuzza, <https://sites.google.com/site/scarabotix>):
/// blocks of numbers, each after a `#` comment that says what it is.
///
/// Its x axis runs down the rows: the center is row, then column (counted from 0), the size is
/// height, then width. The polynomials are preceded by their count. The inverse polynomial is an
/// approximation and not used.
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

/// py-OCamCalib's JSON (<https://github.com/jakarto3d/py-OCamCalib>): Scaramuzza's model with x
/// along the columns and z out of the lens, so the polynomial has the opposite sign of
/// `OCamCalib`'s.
///
/// It has no frame size. Its `world2cam` applies `e` to the stretched x; the stretch
/// matrix is meant as it is written, which is what its `cam2world` inverts.
pub(super) fn read_python(fields: &Fields<'_>) -> Result<Camera, FormatError> {
    let polynomial = fields.numbers("taylor_coefficient")?;
    let lens = ColumnFirst::read(fields, ["distortion_center", "stretch_matrix"], &polynomial)?;
    Ok(Camera::new(None, lens.into_lens()?))
}

/// The model as programs after `OCamCalib` store it: x runs along the columns, so that
/// `u = c·x + d·y + cx`, `v = e·x + y + cy`.
pub(super) struct ColumnFirst {
    /// The direct polynomial with `OCamCalib`'s signs: the first coefficient is negative.
    pub(super) polynomial: Vec<f64>,
    /// `c`, `d`, `e`.
    pub(super) affine: [f64; 3],
    /// `cx`, `cy`.
    pub(super) center: [f64; 2],
}

impl ColumnFirst {
    /// Reads the center and the stretch matrix of these fields, beside a polynomial whose z axis
    /// points out of the lens.
    pub(super) fn read(
        fields: &Fields<'_>,
        [center, stretch]: [&str; 2],
        polynomial: &[f64],
    ) -> Result<Self, FormatError> {
        let center = fields.exactly(center, "column and row")?;
        let [c, d, e, one] = fields.exactly(stretch, "[[c, d], [e, 1]]")?;
        if one != 1.0 {
            let problem = format!("its last number is {one}: it must be 1");
            return Err(fields.invalid(stretch, problem));
        }
        Ok(Self {
            polynomial: negated(polynomial),
            affine: [c, d, e],
            center,
        })
    }

    /// The same lens with `OCamCalib`'s axes, whose affine map has its 1 in the other corner.
    ///
    /// With `rho' = c·rho` the maps agree for `c' = 1/c`, `d' = e/c`, `e' = d/c`, and the
    /// polynomial for `a'_i = a_i·c^(1-i)`, because `theta = atan2(rho, -p(rho))` must stay.
    pub(super) fn into_lens(self) -> Result<Ocam, FormatError> {
        let [c, d, e] = self.affine;
        if !(c.is_finite() && c > 0.0) {
            return Err(FormatError::invalid(
                "c",
                format!("it is {c}: the stretch of the columns must be above 0, and near 1"),
            ));
        }
        let mut factor = c;
        let mut polynomial = self.polynomial;
        for coefficient in &mut polynomial {
            *coefficient *= factor;
            factor /= c;
        }
        Ok(Ocam {
            c: 1.0 / c,
            d: e / c,
            e: d / c,
            ..Ocam::new(polynomial, self.center)
        })
    }
}

/// Turns a direct polynomial whose z axis points out of the lens into `OCamCalib`'s signs.
pub(super) fn negated(polynomial: &[f64]) -> Vec<f64> {
    polynomial.iter().map(|coefficient| -coefficient).collect()
}

/// `fisheyeIntrinsics` or `fisheyeParameters` of MATLAB as `jsonencode` writes them
/// (<https://www.mathworks.com/help/vision/ref/fisheyeintrinsics.html>): Scaramuzza's model with x
/// along the columns and z out of the lens. `cameraIntrinsicsKB` has the model of `cv::fisheye`
/// (<https://www.mathworks.com/help/vision/ref/cameraintrinsicskb.html>).
///
/// The polynomial has no linear term: `a0 a2 a3 a4`. The size is height, then width. The first
/// pixel has its center at 1.
pub(super) fn read_matlab(fields: &Fields<'_>) -> Result<Camera, FormatError> {
    let camera = fields.or_child("Intrinsics")?;
    let size = "ImageSize";
    let sides = camera.exactly(size, "height and width")?.map(whole_pixels);
    let [Some(height), Some(width)] = sides else {
        return Err(camera.invalid(size, "whole numbers of pixels are needed"));
    };
    let image = Some(NativeImage { width, height });
    if camera.has(MATLAB_FIELDS[1]) {
        let [fx, fy] = camera.exactly("FocalLength", "fx, fy")?;
        let [cx, cy] = camera.exactly("PrincipalPoint", "column and row")?;
        let k = camera.exactly(MATLAB_FIELDS[1], "k1 to k4")?;
        let lens = KannalaBrandt::new([fx, fy, cx - 1.0, cy - 1.0], k);
        return Ok(Camera::new(image, lens));
    }
    let [a0, a2, a3, a4] = camera.exactly(POLYNOMIAL, "a0, a2, a3, a4")?;
    let names = ["DistortionCenter", "StretchMatrix"];
    let mut lens = ColumnFirst::read(&camera, names, &[a0, 0.0, a2, a3, a4])?;
    lens.center = lens.center.map(|pixel| pixel - 1.0);
    Ok(Camera::new(image, lens.into_lens()?))
}

/// MultiCol-SLAM's `InteriorOrientationFisheye*.yaml`, known from the `LaFiDa` data set:
/// Scaramuzza's model with x along the columns (<https://github.com/urbste/MultiCol-SLAM>,
/// `cam_model_omni.cpp`).
///
/// Flat `Camera.key: value` lines. Published files leave out the space after some colons, which
/// YAML would not read, so they are read line by line.
pub(super) fn read_multicol(text: &str) -> Result<Camera, FormatError> {
    let entries = text.lines().filter_map(|line| {
        let (key, value) = line.split('#').next()?.split_once(':')?;
        Some((key.trim().to_owned(), Value::from(value.trim())))
    });
    let settings = Value::Object(entries.collect());
    let settings = Fields::new(&settings)?;
    let count = settings.number("Camera.nrpol")?;
    if !(1.0..=MAX_COEFFICIENTS).contains(&count) {
        let problem = format!("it is {count}: 1 to {MAX_COEFFICIENTS} coefficients are read");
        return Err(settings.invalid("Camera.nrpol", problem));
    }
    let indices = (0_u32..).take_while(|index| f64::from(*index) < count);
    let polynomial = indices.map(|index| settings.number(&format!("Camera.a{index}")));
    let lens = ColumnFirst {
        polynomial: polynomial.collect::<Result<_, _>>()?,
        affine: settings.each(["Camera.c", "Camera.d", "Camera.e"])?,
        center: settings.each(["Camera.u0", "Camera.v0"])?,
    };
    let image = settings.image("Camera.Iw", "Camera.Ih")?;
    Ok(Camera::new(Some(image), lens.into_lens()?))
}
