//! Installation of the file that the authors of a network publish.

use std::{
    io::{Cursor, Read},
    path::Path,
    str::FromStr,
};

use lookdown_common::replace_file;
use lookdown_lens::revision::sha256_of;
use reqwest::redirect::Policy;
use zip::ZipArchive;

use super::{
    error::FetchError,
    source::{ModelSource, get, open, within_https},
};
use crate::inference::{
    ModelManifest,
    heads::Head,
    manifest::{Upstream, is_sum, record_of},
    onnx_file,
};

/// Most entries of an archive.
const MAX_MEMBERS: usize = 1000;

/// A SHA-256 in 64 hexadecimal digits.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sha256Sum(String);

impl FromStr for Sha256Sum {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        is_sum(text)
            .then(|| Self(text.to_ascii_lowercase()))
            .ok_or("give 64 hexadecimal digits")
    }
}

/// An installed model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Installed {
    /// Length of the ONNX file in the folder of the model.
    pub bytes: usize,
    /// SHA-256 of the published ONNX file.
    pub published_sha256: String,
    /// True if the graph was cut.
    pub is_cut: bool,
}

/// Fetches the published file of `model`, verifies and converts it, and puts it into the folder of
/// the model together with a record of its sum. `source` is a mirror: a folder or an address with
/// NAME/FILE, where FILE is the file name of `upstream.url`. `accepted` is the sum that the caller
/// expects, required when the manifest has none. Blocks.
///
/// # Errors
/// [`FetchError`]; the folder is then unchanged, unless its files cannot be written.
pub fn fetch_upstream(
    model: &ModelManifest,
    upstream: &Upstream,
    source: Option<&ModelSource>,
    accepted: Option<&Sha256Sum>,
) -> Result<Installed, FetchError> {
    let (place, reader) = match source {
        Some(source) => open(source, &model.name, Path::new(upstream.file_name()))?,
        None => get(upstream.url.to_string(), Policy::custom(within_https))?,
    };
    let published = bounded(reader, &place)?;
    let published = match &upstream.member {
        Some(member) => extract(published, member, &place)?,
        None => published,
    };
    let published_sha256 = sha256_of(&published);
    check_sum(
        &place,
        &published_sha256,
        upstream.sha256.as_deref(),
        accepted,
    )?;
    let unusable = |problem| FetchError::Unusable {
        place: place.clone(),
        problem,
    };
    onnx_file::check(&published).map_err(unusable)?;
    let installed = match &model.output {
        Head::BoxesScores(head) if upstream.cut => {
            onnx_file::cut(&published, &[&head.boxes, &head.scores]).map_err(unusable)?
        }
        _ => published,
    };
    install(&model.onnx, &installed)?;
    Ok(Installed {
        bytes: installed.len(),
        published_sha256,
        is_cut: upstream.cut,
    })
}

fn check_sum(
    place: &str,
    found: &str,
    pinned: Option<&str>,
    accepted: Option<&Sha256Sum>,
) -> Result<(), FetchError> {
    let (place, found) = (place.to_owned(), found.to_owned());
    match (pinned, accepted) {
        (None, None) => Err(FetchError::UnknownSum { place, found }),
        (Some(pinned), _) if !pinned.eq_ignore_ascii_case(&found) => Err(FetchError::WrongSum {
            place,
            found,
            wanted: pinned.to_owned(),
        }),
        (_, Some(Sha256Sum(accepted))) if *accepted != found => Err(FetchError::NotAccepted {
            place,
            found,
            accepted: accepted.clone(),
        }),
        _ => Ok(()),
    }
}

/// Reads a file of at most the largest length of an ONNX file.
fn bounded(reader: impl Read, place: &str) -> Result<Vec<u8>, FetchError> {
    let place = || place.to_owned();
    let mut bytes = Vec::new();
    let read = reader
        .take(onnx_file::MAX_BYTES + 1)
        .read_to_end(&mut bytes);
    match read {
        Ok(length) if length as u64 > onnx_file::MAX_BYTES => Err(FetchError::TooLarge {
            place: place(),
            limit: onnx_file::MAX_BYTES,
        }),
        Ok(_) => Ok(bytes),
        Err(error) => Err(FetchError::Unreadable {
            place: place(),
            problem: error.to_string(),
        }),
    }
}

/// Reads the only file of an archive with that name, in any folder of the archive.
fn extract(archive: Vec<u8>, member: &str, place: &str) -> Result<Vec<u8>, FetchError> {
    let failed = |problem: String| FetchError::Archive {
        place: place.to_owned(),
        problem,
    };
    let mut archive =
        ZipArchive::new(Cursor::new(archive)).map_err(|error| failed(error.to_string()))?;
    if archive.len() > MAX_MEMBERS {
        return Err(failed(format!("it has more than {MAX_MEMBERS} files")));
    }
    let paths: Result<Vec<_>, _> = archive.file_names().collect();
    let paths = paths.map_err(|error| failed(error.to_string()))?;
    let mut found = paths
        .iter()
        .filter(|path| path.rsplit('/').next() == Some(member));
    let (Some(path), None) = (found.next().map(ToString::to_string), found.next()) else {
        return Err(failed(format!("it does not have one file {member:?}")));
    };
    let file = archive
        .by_name(&path)
        .map_err(|error| failed(error.to_string()))?;
    bounded(file, &format!("{member} in {place}"))
}

/// Writes an ONNX file and the record of its sum, each in one step.
fn install(onnx: &Path, bytes: &[u8]) -> Result<(), FetchError> {
    let file_name = onnx.file_name().unwrap_or_default().to_string_lossy();
    let record = format!("{}  {file_name}\n", sha256_of(bytes));
    // A server that reads the new file needs the new record.
    replace(&record_of(onnx), record.as_bytes())?;
    replace(onnx, bytes)
}

fn replace(path: &Path, content: &[u8]) -> Result<(), FetchError> {
    replace_file(path, content).map_err(|source| FetchError::Unwritable {
        path: path.to_owned(),
        source,
    })
}
