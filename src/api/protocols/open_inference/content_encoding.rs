//! Decompression of the body of an inference request, `Content-Encoding: gzip` or `deflate`, within
//! the limits of a body.

use std::io::{ErrorKind, Read};

use axum::http::{HeaderMap, header::CONTENT_ENCODING};
use bytes::Bytes;
use flate2::read::{MultiGzDecoder, ZlibDecoder};
use lookdown_common::text::Quoted;

use super::request::malformed;
use crate::api::http::{
    problem::{Problem, ProblemKind},
    request_body::{Held, UploadBudget},
};

/// The number of bytes that are decompressed at a time.
const CHUNK_BYTES: usize = 64 * 1024;

/// Returns the body without its encoding. A decompressed body has its own share of the budget, and
/// at most `max_bytes`.
pub(super) fn decompressed(
    headers: &HeaderMap,
    body: Bytes,
    max_bytes: usize,
    budget: &UploadBudget,
) -> Result<Bytes, Problem> {
    let Some(encoding) = headers.get(CONTENT_ENCODING) else {
        return Ok(body);
    };
    match encoding.as_bytes().to_ascii_lowercase().as_slice() {
        b"identity" => Ok(body),
        b"gzip" => read(MultiGzDecoder::new(&*body), max_bytes, budget),
        b"deflate" => read(ZlibDecoder::new(&*body), max_bytes, budget),
        other => {
            let other = String::from_utf8_lossy(other);
            let other = Quoted(&other);
            Err(malformed(&format!(
                "Content-Encoding is {other}: send gzip, deflate or no compression"
            )))
        }
    }
}

fn read(mut decoder: impl Read, max_bytes: usize, budget: &UploadBudget) -> Result<Bytes, Problem> {
    let mut bytes = Vec::new();
    let mut chunk = vec![0; CHUNK_BYTES];
    let mut share = budget.take(0)?;
    loop {
        let length = match decoder.read(&mut chunk) {
            Ok(0) => break,
            Ok(length) => length,
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            Err(error) => {
                return Err(malformed(&format!(
                    "the body cannot be decompressed ({error}): send it as Content-Encoding states"
                )));
            }
        };
        if bytes.len() + length > max_bytes {
            let detail = format!(
                "the decompressed body is larger than {max_bytes} bytes: send smaller images or \
                 raise server.max_body_bytes"
            );
            return Err(Problem::new(ProblemKind::BodyTooLarge, detail));
        }
        share.merge(budget.take(length)?);
        bytes.extend_from_slice(&chunk[..length]);
    }
    Ok(Held::new(Bytes::from(bytes), share).into_bytes())
}
