//! Parses `multipart/form-data`: the frame, and parameters as text fields.
//!
//! The parameters that may accompany a frame.

use axum::{
    body::Body,
    extract::{DefaultBodyLimit, FromRequest, Multipart, Request, multipart::MultipartError},
    http::request::Parts,
};
use bytes::Bytes;
use lookdown_common::text::is_invisible;
use lookdown_detect::parameters::ParameterError;

use crate::api::{
    http::problem::{Problem, ProblemKind},
    parameters,
};

/// Largest number of fields of a form: every parameter and the frame, with room for repeated
/// fields, which have a better error message.
const MAX_FIELDS: usize = 24;
/// Largest parameter value, bytes.
const MAX_VALUE_BYTES: usize = 1024;

/// Longest file name of a frame, characters.
const MAX_FILE_NAME_CHARS: usize = 255;

/// The use of a form field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::api) enum FieldUse {
    /// The frame.
    Frame,
    /// The frame, or a further one of the same camera.
    Frames,
    /// A parameter.
    Parameter,
    /// Not used and ignored.
    None,
}

/// The content of a form.
#[derive(Default)]
pub(in crate::api) struct Form {
    pub(in crate::api) image: Bytes,
    /// Further frames, where the request may have some.
    pub(in crate::api) further_images: Vec<Bytes>,
    /// The field of the frame.
    pub(in crate::api) field: Option<String>,
    /// The name of the frame's file, without its folders.
    pub(in crate::api) file_name: Option<String>,
    pub(in crate::api) parameters: Vec<(String, String)>,
}

/// Parses a form. `body` is complete, so this never waits for the client.
pub(super) async fn parse(
    parts: Parts,
    body: Bytes,
    use_of: fn(&str) -> Result<FieldUse, Problem>,
) -> Result<Form, Problem> {
    let ending = wrong_line_ending(&body);
    let broken = |error| ending.map_or_else(|| broken(error), malformed);
    let mut request = Request::from_parts(parts, Body::from(body));
    // The body was limited when it was read.
    DefaultBodyLimit::disable().apply(&mut request);
    let mut multipart = Multipart::from_request(request, &())
        .await
        .map_err(|_| malformed("the Content-Type must be multipart/form-data with a boundary"))?;
    let mut image = None;
    let mut further_images = Vec::new();
    let mut file_name = None;
    let mut parameters = Vec::new();
    let mut fields = 0;
    while let Some(field) = multipart.next_field().await.map_err(broken)? {
        fields += 1;
        if fields > MAX_FIELDS {
            let detail = format!("the form has more than {MAX_FIELDS} fields: send each once");
            return Err(malformed(&detail));
        }
        let name = field.name().unwrap_or_default().to_owned();
        match use_of(&name)? {
            field_use @ (FieldUse::Frame | FieldUse::Frames) => {
                file_name = field.file_name().and_then(name_of_file);
                let bytes = field.bytes().await.map_err(broken)?;
                if file_name.is_none() && is_file_name(&bytes) {
                    return Err(name_instead_of_file(&name));
                }
                if image.is_none() {
                    image = Some((bytes, name));
                } else if field_use == FieldUse::Frames {
                    further_images.push(bytes);
                } else {
                    return Err(second_image(&name));
                }
            }
            FieldUse::Parameter => {
                let value = value_of(&name, &field.bytes().await.map_err(broken)?)?;
                parameters.push((name, value));
            }
            FieldUse::None => {}
        }
    }
    let (image, field) = image.ok_or_else(missing_image)?;
    Ok(Form {
        image,
        further_images,
        field: Some(field),
        file_name,
        parameters,
    })
}

fn value_of(name: &str, bytes: &[u8]) -> Result<String, Problem> {
    if bytes.len() > MAX_VALUE_BYTES {
        let fault = format!("the value is longer than {MAX_VALUE_BYTES} bytes");
        return Err(invalid(name, &fault));
    }
    let text = str::from_utf8(bytes).map_err(|_| invalid(name, "the value is not UTF-8 text"))?;
    Ok(text.to_owned())
}

fn invalid(name: &str, fault: &str) -> Problem {
    Problem::for_parameter(ProblemKind::InvalidParameter, name, fault)
}

fn missing_image() -> Problem {
    let fault = "the form has no frame: send one in the field `img` or `image`, as in curl -F \
                 img=@frame.jpg";
    Problem::for_parameter(ProblemKind::MissingImage, "img", fault)
}

/// Returns true for the name of an image file, which curl sends for `-F img=frame.jpg`.
fn is_file_name(content: &[u8]) -> bool {
    let endings = [".jpg", ".jpeg", ".png", ".webp"];
    let text = str::from_utf8(content).unwrap_or_default().to_lowercase();
    text.len() <= MAX_VALUE_BYTES && endings.iter().any(|ending| text.ends_with(ending))
}

fn name_instead_of_file(name: &str) -> Problem {
    let fault = "the value is the name of a file, not its content: put @ before the name, as in \
                 curl -F img=@frame.jpg";
    Problem::for_parameter(ProblemKind::MissingImage, name, fault)
}

fn second_image(name: &str) -> Problem {
    let fault = "the form has two frames: send one frame per request";
    Problem::for_parameter(ProblemKind::RepeatedParameter, name, fault)
}

/// Returns the last segment of a path of any operating system, if it is a name.
fn name_of_file(path: &str) -> Option<String> {
    let name = path.rsplit(['/', '\\']).next().unwrap_or(path);
    let characters = name.chars().filter(|&character| !is_invisible(character));
    let name: String = characters.take(MAX_FILE_NAME_CHARS).collect();
    (!name.is_empty()).then_some(name)
}

fn malformed(detail: &str) -> Problem {
    Problem::new(ProblemKind::MalformedRequest, detail)
}

/// Returns the fault of a form whose lines end with LF alone, which scripts write.
fn wrong_line_ending(body: &[u8]) -> Option<&'static str> {
    let end = body.iter().position(|byte| *byte == b'\n')?;
    let is_wrong = body.starts_with(b"--") && body[end - 1] != b'\r';
    is_wrong.then_some("the lines of the multipart form end with LF: end them with CRLF")
}

#[expect(clippy::needless_pass_by_value, reason = "the shape map_err needs")]
fn broken(error: MultipartError) -> Problem {
    let reason = error.body_text();
    malformed(&format!(
        "the multipart form is malformed or cut off: {reason}"
    ))
}

/// The names of the frame's field.
const FRAME_NAMES: [&str; 2] = ["img", "image"];

/// Returns the use of a field of `POST /detect`; other fields are refused.
pub(super) fn use_in_detection(name: &str) -> Result<FieldUse, Problem> {
    let known: Vec<_> = parameters::all().map(|spec| spec.name).collect();
    use_among(&known, name)
}

/// Returns the use of a field of a form with a frame and these parameters; others are refused.
fn use_among(parameters: &[&str], name: &str) -> Result<FieldUse, Problem> {
    if FRAME_NAMES.contains(&name) {
        Ok(FieldUse::Frame)
    } else if parameters.contains(&name) {
        Ok(FieldUse::Parameter)
    } else {
        let problem = format!(
            "there is no such field or parameter: send the frame as `img` or `image`; the parameters are {}",
            parameters.join(", ")
        );
        Err(ParameterError::unknown(name, problem).into())
    }
}

/// Returns the use of a field of a form with one or more frames and these parameters; others are
/// refused.
pub(in crate::api) fn frames_among(parameters: &[&str], name: &str) -> Result<FieldUse, Problem> {
    let field_use = use_among(parameters, name)?;
    Ok(match field_use {
        FieldUse::Frame => FieldUse::Frames,
        other => other,
    })
}

/// Returns the problem of a frame in the query.
pub(super) fn frame_in_query(name: &str) -> Problem {
    let problem = "it is in the query: send the frame as the body or in a form".to_owned();
    ParameterError::unknown(name, problem).into()
}
