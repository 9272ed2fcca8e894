//! What a frame is answered with: the report as JSON, the frame with boxes drawn into it, or a file
//! for annotation tools.

mod format;

use axum::http::HeaderMap;
use bytes::Bytes;

use self::format::AnswerFormat;
use super::problem::{Problem, ProblemKind};
use crate::{
    annotated_picture::{PictureError, PictureOptions, annotated_picture},
    annotation_formats::{AnnotatedImage, BoxKind},
    pipeline::{Detected, ParameterError, PipelineError},
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
    /// The parameters about the answer.
    pub(super) const NAMES: [&'static str; 4] = [
        "format",
        PictureOptions::NAMES[0],
        PictureOptions::NAMES[1],
        PictureOptions::NAMES[2],
    ];

    /// Takes the parameters about the answer out of a request's.
    pub(super) fn take_from(
        parameters: &mut Vec<(String, String)>,
        headers: &HeaderMap,
        file_name: Option<String>,
    ) -> Result<Self, Problem> {
        let mut given: [Option<String>; Self::NAMES.len()] = [const { None }; _];
        let own = |name: &str| Self::NAMES.iter().position(|known| *known == name);
        for (name, value) in parameters.extract_if(.., |(name, _)| own(name).is_some()) {
            let place = own(&name).and_then(|index| given.get_mut(index));
            if place.is_some_and(|place| place.replace(value).is_some()) {
                return Err(ParameterError::repeated(&name).into());
            }
        }
        let [format, draw, width, quality] = given.each_ref().map(Option::as_deref);
        Ok(Self {
            format: AnswerFormat::of(format, headers)?,
            picture: PictureOptions::parse([draw, width, quality])?,
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
