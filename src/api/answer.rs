//! What a frame is answered with: the report as JSON, the frame with boxes drawn into it, or a file
//! for annotation tools.

mod format;

use axum::http::HeaderMap;
use bytes::Bytes;

use self::format::AnswerFormat;
pub(super) use self::format::TABLE;
use super::{
    parameters::{self, pairs},
    problem::{Problem, ProblemKind},
};
use crate::{
    annotated_picture::{PictureError, PictureOptions, annotated_picture},
    annotation_formats::{AnnotatedImage, BoxKind},
    pipeline::{Detected, PipelineError},
};

/// What a frame is called whose sender gave it no name.
const NAMELESS: &str = "frame";

/// What a request wants to be answered with.
pub(super) struct AnswerOptions {
    format: AnswerFormat,
    picture: PictureOptions,
    /// The frame's, as it was sent.
    file_name: Option<String>,
}

/// An answer's content.
pub(super) struct Content {
    pub(super) media_type: &'static str,
    pub(super) bytes: Bytes,
}

impl AnswerOptions {
    /// Takes the parameters about the answer out of those of a request.
    pub(super) fn take_from(
        given: &mut Vec<(String, String)>,
        headers: &HeaderMap,
        file_name: Option<String>,
    ) -> Result<Self, Problem> {
        let format = parameters::take(given, TABLE);
        let picture = parameters::take(given, PictureOptions::TABLE);
        Ok(Self {
            format: AnswerFormat::read(pairs(&format), headers)?,
            picture: PictureOptions::parse(pairs(&picture))?,
            file_name,
        })
    }

    /// The answer about a frame whose report is `json`. Drawing takes its time: call it where that is
    /// allowed.
    pub(super) fn content(self, detected: Detected, json: &Bytes) -> Result<Content, Problem> {
        let report = &detected.report;
        let bytes = match self.format {
            AnswerFormat::Report => json.clone(),
            AnswerFormat::Picture(format) => {
                let picture = annotated_picture(detected, format, &self.picture);
                picture.map_err(not_drawn)?.into()
            }
            AnswerFormat::Annotations(format) => {
                let name = self.file_name.unwrap_or_else(|| NAMELESS.to_owned());
                let image = AnnotatedImage::of(report, name);
                format.document(&image, BoxKind::default()).into()
            }
        };
        Ok(Content {
            media_type: self.format.media_type(),
            bytes,
        })
    }
}

fn not_drawn(error: PictureError) -> Problem {
    match error {
        PictureError::Cancelled(_) => PipelineError::Withdrawn.into(),
        PictureError::Encode(error) => {
            Problem::new(ProblemKind::UnfitImage, format!("{error}: ask for a width"))
                .with_parameter("width")
        }
    }
}
