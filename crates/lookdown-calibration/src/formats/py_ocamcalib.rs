//! py-OCamCalib's JSON (<https://github.com/jakarto3d/py-OCamCalib>): Scaramuzza's model with x
//! along the columns and z out of the lens, so the polynomial has the opposite sign of
//! `OCamCalib`'s.
//!
//! It has no frame size. Its `world2cam` applies `e` to the stretched x; the stretch
//! matrix is meant as it is written, which is what its `cam2world` inverts.

use super::{
    Camera, FormatError,
    column_first::{ColumnFirst, negated},
    fields::Fields,
};

pub(super) fn read(fields: &Fields<'_>) -> Result<Camera, FormatError> {
    let [cx, cy] = fields.exactly("distortion_center", "column and row")?;
    let [c, d, e, one] = fields.exactly("stretch_matrix", "[[c, d], [e, 1]]")?;
    if one != 1.0 {
        let problem = format!("its last number is {one}: it must be 1");
        return Err(fields.invalid("stretch_matrix", problem));
    }
    let lens = ColumnFirst {
        polynomial: negated(&fields.numbers("taylor_coefficient")?),
        c,
        d,
        e,
        cx,
        cy,
    };
    Ok(Camera::new(None, lens.into_lens()?))
}
