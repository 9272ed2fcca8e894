//! Fetching of converted weights, whose sum is in the manifest.

use std::{
    fs::File,
    io::{self, Read, Write},
    path::Path,
};

use lookdown_common::Replacement;
use sha2::{Digest, Sha256};

use super::{
    error::FetchError,
    source::{ModelSource, open},
};
use crate::inference::ModelManifest;

/// Largest file of weights, bytes: the limit of an ONNX file in one part.
const MAX_BYTES: u64 = 2 << 30;
/// Bytes that are copied at a time.
const CHUNK: usize = 1 << 20;

/// Fetches the weights of `model` and puts them into its folder in one step, after their sum was
/// compared. Returns the number of bytes. Blocks.
///
/// # Errors
/// [`FetchError`]; the folder is then unchanged.
pub fn fetch_weights(model: &ModelManifest, source: &ModelSource) -> Result<u64, FetchError> {
    let Some(wanted) = &model.sha256 else {
        let name = model.name.clone();
        return Err(FetchError::NoSum { name });
    };
    let file = model.onnx.file_name().unwrap_or_default();
    let (place, reader) = open(source, &model.name, Path::new(file))?;
    let unwritable = |source| FetchError::Unwritable {
        path: model.onnx.clone(),
        source,
    };
    Replacement::of(&model.onnx).fill(unwritable, |file| {
        copy(reader, &place, file, wanted, unwritable)
    })
}

/// Copies a file whose sum is `wanted`. Returns the number of bytes.
fn copy(
    reader: impl Read,
    place: &str,
    to: &mut File,
    wanted: &str,
    unwritable: impl Fn(io::Error) -> FetchError,
) -> Result<u64, FetchError> {
    let place = || place.to_owned();
    let mut reader = reader.take(MAX_BYTES + 1);
    let (mut sum, mut bytes, mut chunk) = (Sha256::new(), 0, vec![0; CHUNK]);
    loop {
        let read = reader
            .read(&mut chunk)
            .map_err(|error| FetchError::Unreadable {
                place: place(),
                problem: error.to_string(),
            })?;
        if read == 0 {
            break;
        }
        sum.update(&chunk[..read]);
        to.write_all(&chunk[..read]).map_err(&unwritable)?;
        bytes += read as u64;
    }
    if bytes > MAX_BYTES {
        return Err(FetchError::TooLarge {
            place: place(),
            limit: MAX_BYTES,
        });
    }
    let found = format!("{:x}", sum.finalize());
    if !found.eq_ignore_ascii_case(wanted) {
        return Err(FetchError::WrongSum {
            place: place(),
            found,
            wanted: wanted.to_owned(),
        });
    }
    Ok(bytes)
}
