//! The end of a JPEG file (ITU-T T.81, annexes B, C and F).

/// The first bytes of a JPEG file.
pub const JPEG_START: &[u8] = &[0xff, 0xd8, 0xff];
/// The marker at the end of a JPEG file.
pub const JPEG_END: &[u8] = &[0xff, 0xd9];

/// Returns the length of a JPEG up to the end of its image, or `None` if the image is not whole.
///
/// The image ends with its marker. Some cameras leave the marker out, or write other bytes in its
/// place: then the image is whole if its scans have all blocks, which only a baseline JPEG shows.
///
/// Segments are skipped by their length, so that the end marker of a thumbnail inside one does not
/// count. Bytes between segments are entropy-coded data or padding.
pub fn jpeg_length(bytes: &[u8]) -> Option<usize> {
    let mut rest = bytes;
    loop {
        match rest {
            [0xff, 0xd9, ..] => return Some(bytes.len() - rest.len() + JPEG_END.len()),
            // A stuffed zero, and markers without a payload. 0xFF before a marker is a fill byte.
            [0xff, 0x00 | 0x01 | 0xd0..=0xd8, ..] => rest = &rest[2..],
            [0xff, 0xff, ..] => rest = &rest[1..],
            // The length includes its own two bytes, but not the marker's.
            [0xff, _, high, low, ..] => {
                let length = usize::from(u16::from_be_bytes([*high, *low]));
                match rest.get(2 + length..) {
                    Some(next) => rest = next,
                    None => return length_of_scans(bytes),
                }
            }
            [0xff, ..] | [] => return length_of_scans(bytes),
            [_, next @ ..] => {
                let entropy_coded = next.iter().take_while(|byte| **byte != 0xff).count();
                rest = &next[entropy_coded..];
            }
        }
    }
}

/// A component of the frame: its name and its sampling factors.
struct Component {
    id: u8,
    columns: usize,
    rows: usize,
    is_decoded: bool,
}

/// Most Huffman tables of a file, each of which takes 128 KiB to fill: four for each of 16 scans.
const MAX_TABLES: usize = 64;

/// Symbols by the next 16 bits: the length of the code above the value, 0 for none.
type Codes = Vec<u16>;

/// Returns the position after the last scan, if all scans have all their blocks.
fn length_of_scans(bytes: &[u8]) -> Option<usize> {
    let mut size = (0, 0);
    let mut components: Vec<Component> = Vec::new();
    let mut tables: [Option<Codes>; 32] = [const { None }; 32];
    let mut table_count = 0;
    let mut restart_interval = 0;
    let mut position = 2;
    loop {
        let (marker, payload) = match bytes.get(position..)? {
            [0xff, 0xff, ..] => {
                position += 1;
                continue;
            }
            [0xff, marker, high, low, rest @ ..] => {
                let length = usize::from(u16::from_be_bytes([*high, *low]));
                (*marker, rest.get(..length.checked_sub(2)?)?)
            }
            _ => return None,
        };
        position += 4 + payload.len();
        match marker {
            0xc0 | 0xc1 => {
                let [8, h0, h1, w0, w1, _, rest @ ..] = payload else {
                    return None;
                };
                let number = |high, low| usize::from(u16::from_be_bytes([high, low]));
                size = (number(*w0, *w1), number(*h0, *h1));
                let component = |of: &[u8]| Component {
                    id: of[0],
                    columns: usize::from(of[1] >> 4).clamp(1, 4),
                    rows: usize::from(of[1] & 15).clamp(1, 4),
                    is_decoded: false,
                };
                components = rest.chunks_exact(3).map(component).collect();
            }
            0xc4 => read_codes(payload, &mut tables, &mut table_count)?,
            0xc2..=0xcf => return None,
            0xdd => restart_interval = usize::from(u16::from_be_bytes(payload.try_into().ok()?)),
            0xda => {
                let mut bits = Bits::new(bytes, position);
                let scan = payload.get(1..)?.chunks_exact(2);
                let scan = scan.take(usize::from(payload[0]));
                read_scan(
                    &mut bits,
                    scan,
                    &mut components,
                    size,
                    &tables,
                    restart_interval,
                )?;
                position = bits.end();
                if components.iter().all(|component| component.is_decoded) {
                    return Some(position);
                }
            }
            _ => {}
        }
    }
}

/// Reads the Huffman tables of a segment (T.81, B.2.4.2).
fn read_codes(
    mut payload: &[u8],
    tables: &mut [Option<Codes>; 32],
    count: &mut usize,
) -> Option<()> {
    while let Some((head, rest)) = payload.split_at_checked(17) {
        *count += 1;
        if *count > MAX_TABLES {
            return None;
        }
        let mut codes = vec![0; 1 << 16];
        let (mut next, mut used) = (0, 0);
        for (shorter, &count) in head[1..].iter().enumerate() {
            for &symbol in rest.get(used..used + usize::from(count))? {
                let code = codes.get_mut(next..next + (1 << (15 - shorter)))?;
                code.fill(u16::try_from(shorter + 1).ok()? << 8 | u16::from(symbol));
                next += code.len();
            }
            used += usize::from(count);
        }
        *tables.get_mut(usize::from(head[0]))? = Some(codes);
        payload = &rest[used..];
    }
    Some(())
}

/// Reads all blocks of a scan. Each component has one scan, and each scan a component: so the work
/// is bounded by the bytes.
fn read_scan<'a>(
    bits: &mut Bits<'_>,
    scan: impl Iterator<Item = &'a [u8]>,
    components: &mut [Component],
    (width, height): (usize, usize),
    tables: &[Option<Codes>; 32],
    restart_interval: usize,
) -> Option<()> {
    let most = |side: fn(&Component) -> usize| components.iter().map(side).max();
    let (most_columns, most_rows) = (most(|of| of.columns)?, most(|of| of.rows)?);
    // The blocks of a unit, with the tables of each component.
    let mut unit = Vec::new();
    let mut pixels = (8 * most_columns, 8 * most_rows);
    let scan: Vec<_> = scan.collect();
    if scan.is_empty() {
        return None;
    }
    for part in &scan {
        let component = components
            .iter_mut()
            .find(|component| component.id == part[0])?;
        if std::mem::replace(&mut component.is_decoded, true) {
            return None;
        }
        let table = |index: u8| tables.get(usize::from(index))?.as_ref();
        let codes = (table(part[1] >> 4)?, table(16 | (part[1] & 15))?);
        let mut blocks = component.columns * component.rows;
        if scan.len() == 1 {
            blocks = 1;
            pixels = (pixels.0 / component.columns, pixels.1 / component.rows);
        }
        unit.extend(std::iter::repeat_n(codes, blocks));
    }
    let units = width.div_ceil(pixels.0) * height.div_ceil(pixels.1);
    for index in 0..units {
        if restart_interval > 0 && index > 0 && index % restart_interval == 0 {
            bits.restart()?;
        }
        for (first, others) in &unit {
            let length = bits.symbol(first)?;
            bits.skip(length)?;
            let mut coefficient = 1;
            while coefficient < 64 {
                let symbol = bits.symbol(others)?;
                bits.skip(symbol & 15)?;
                match symbol {
                    // The rest of the block is 0.
                    0x00 => break,
                    _ => coefficient += 1 + usize::from(symbol >> 4),
                }
            }
        }
    }
    (units > 0).then_some(())
}

/// The bits of entropy-coded data.
struct Bits<'a> {
    bytes: &'a [u8],
    position: usize,
    buffer: u64,
    count: u32,
}

impl<'a> Bits<'a> {
    fn new(bytes: &'a [u8], position: usize) -> Self {
        Self {
            bytes,
            position,
            buffer: 0,
            count: 0,
        }
    }

    /// Fills the buffer up to the next marker.
    fn fill(&mut self) {
        while self.count <= 48 {
            let (byte, length) = match self.bytes.get(self.position..) {
                Some([0xff, 0x00, ..]) => (0xff, 2),
                Some([0xff, ..] | []) | None => return,
                Some([byte, ..]) => (*byte, 1),
            };
            self.buffer = self.buffer << 8 | u64::from(byte);
            self.count += 8;
            self.position += length;
        }
    }

    fn symbol(&mut self, codes: &Codes) -> Option<u8> {
        self.fill();
        let next = if self.count >= 16 {
            self.buffer >> (self.count - 16)
        } else {
            self.buffer << (16 - self.count)
        };
        let [length, symbol] = codes[(next & 0xffff) as usize].to_be_bytes();
        self.skip(length)?;
        (length > 0).then_some(symbol)
    }

    fn skip(&mut self, bits: u8) -> Option<()> {
        self.fill();
        self.count = self.count.checked_sub(u32::from(bits))?;
        Some(())
    }

    /// Takes a restart marker.
    fn restart(&mut self) -> Option<()> {
        self.count = 0;
        let [0xff, 0xd0..=0xd7, ..] = self.bytes.get(self.position..)? else {
            return None;
        };
        self.position += 2;
        Some(())
    }

    /// The position after the bits that were read.
    fn end(&self) -> usize {
        self.position - (self.count / 8) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scans_without_components_and_many_tables_end_at_once() {
        let head = [
            0xff, 0xd8, 0xff, 0xc0, 0, 11, 8, 0xff, 0xff, 0xff, 0xff, 1, 1, 0x11, 0,
        ];
        let empty_scan = [0xff, 0xda, 0, 6, 0, 0, 63, 0];
        let table = [&[0xff, 0xc4, 0, 19, 0][..], &[0; 16]].concat();
        for part in [&empty_scan[..], &table] {
            let file = [&head[..], &part.repeat(100_000)].concat();
            assert_eq!(jpeg_length(&file), None);
        }
    }
}
