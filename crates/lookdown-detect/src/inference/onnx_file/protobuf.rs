//! The wire format of protocol buffers, as far as ONNX files need it.
//!
//! Source: "Encoding", protocol buffers documentation.

/// Deepest nesting of graphs within graphs.
pub(super) const MAX_DEPTH: usize = 64;

/// The message about bytes that are not a complete model.
pub(super) fn no_model() -> String {
    "it is not an ONNX model, or is cut off".to_owned()
}

/// A field of a message.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Field<'a> {
    pub(super) number: u64,
    pub(super) value: Value<'a>,
}

/// Value of a field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Value<'a> {
    Varint(u64),
    /// A string, a message or packed numbers.
    Bytes(&'a [u8]),
    /// A number of four or eight bytes, which is skipped.
    Fixed,
}

impl<'a> Value<'a> {
    /// The numbers of a repeated field, packed or not. Ends with an error where they are cut off.
    pub(super) fn varints(self) -> impl Iterator<Item = Result<u64, ()>> + use<'a> {
        let (single, mut packed) = match self {
            Self::Varint(number) => (Some(Ok(number)), &[][..]),
            Self::Bytes(bytes) => (None, bytes),
            Self::Fixed => (Some(Err(())), &[][..]),
        };
        let rest = std::iter::from_fn(move || {
            (!packed.is_empty()).then(|| {
                let number = varint(&mut packed).ok_or(());
                if number.is_err() {
                    packed = &[];
                }
                number
            })
        });
        single.into_iter().chain(rest)
    }
}

/// The fields of a message in order. Ends with an error at the first invalid field.
pub(super) fn fields(mut bytes: &[u8]) -> impl Iterator<Item = Result<Field<'_>, ()>> {
    std::iter::from_fn(move || {
        (!bytes.is_empty()).then(|| {
            let field = field(&mut bytes).ok_or(());
            if field.is_err() {
                bytes = &[];
            }
            field
        })
    })
}

fn field<'a>(bytes: &mut &'a [u8]) -> Option<Field<'a>> {
    let tag = varint(bytes)?;
    let value = match tag & 7 {
        0 => Value::Varint(varint(bytes)?),
        1 => take(bytes, 8).map(|_| Value::Fixed)?,
        2 => {
            let len = usize::try_from(varint(bytes)?).ok()?;
            Value::Bytes(take(bytes, len)?)
        }
        5 => take(bytes, 4).map(|_| Value::Fixed)?,
        _ => return None,
    };
    let number = tag >> 3;
    (number > 0).then_some(Field { number, value })
}

fn take<'a>(bytes: &mut &'a [u8], len: usize) -> Option<&'a [u8]> {
    let (taken, rest) = bytes.split_at_checked(len)?;
    *bytes = rest;
    Some(taken)
}

/// Reads a varint: seven bits per byte, least significant first, at most ten bytes.
fn varint(bytes: &mut &[u8]) -> Option<u64> {
    let mut number = 0;
    for shift in (0..64).step_by(7) {
        let (&byte, rest) = bytes.split_first()?;
        *bytes = rest;
        number |= u64::from(byte & 0x7f) << shift;
        if byte < 0x80 {
            return Some(number);
        }
    }
    None
}
