//! py-OCamCalib's JSON (<https://github.com/jakarto3d/py-OCamCalib>): Scaramuzza's model with x
//! along the columns and z out of the lens, so the polynomial has the opposite sign of
//! `OCamCalib`'s.
//!
//! It has no frame size. Its `world2cam` applies `e` to the stretched x; the stretch
//! matrix is meant as it is written, which is what its `cam2world` inverts.

use super::{Camera, FormatError, column_first::ColumnFirst, fields::Fields};

pub(super) fn read(fields: &Fields<'_>) -> Result<Camera, FormatError> {
    let polynomial = fields.numbers("taylor_coefficient")?;
    let lens = ColumnFirst::read(fields, ["distortion_center", "stretch_matrix"], &polynomial)?;
    Ok(Camera::new(None, lens.into_lens()?))
}
