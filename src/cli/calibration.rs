//! `lookdown calibration`

mod check;
mod fit;
mod people;
mod place;
mod source;

use std::{
    io::{self, Write},
    path::PathBuf,
    process::ExitCode,
};

use anyhow::Context;
use clap::{Args, Subcommand};
use lookdown_calibration::export::Target;
use serde::Deserialize;
use serde_json::json;

use self::{
    people::{PeopleSource, set_height},
    source::{Source, read_frame, read_frames, write_native},
};
use super::{
    async_runtime::for_this_thread,
    parameters::one_of,
    progress::{UNWRITABLE, write_or_print},
    server_flags::{ServerFlags, SettingsFile, read_json},
};

/// The subcommands for calibrations.
#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Show the content of a calibration file of any format, and draw it into a frame
    Check(check::Arguments),
    /// Write a calibration in the native format, or in that of another program
    Convert(ConvertArguments),
    /// Fit a calibration to frames of the room: lens, center and level from its straight edges
    Fit(fit::Arguments),
    /// Find the height of a camera from the people in its frames or reports
    Height(HeightArguments),
    /// Find the place of a camera on the floor of another, from people who walk through both views
    Place(place::Arguments),
    /// Suggest an area from the places where people walked
    SuggestArea(SuggestAreaArguments),
}

/// Runs the subcommand.
pub(super) fn run(command: &Command) -> anyhow::Result<ExitCode> {
    match command {
        Command::Check(arguments) => check::run(arguments),
        Command::Convert(arguments) => convert(arguments),
        Command::Fit(arguments) => fit::run(arguments),
        Command::Height(arguments) => height(arguments),
        Command::Place(arguments) => place::run(arguments),
        Command::SuggestArea(arguments) => suggest_area(arguments),
    }
}

/// Arguments of `lookdown calibration convert`.
#[derive(Debug, Args)]
pub(super) struct ConvertArguments {
    #[command(flatten)]
    source: Source,
    /// The format to write
    #[arg(long, value_name = "FORMAT", default_value = "native", value_parser = one_of::<Target>())]
    to: Target,
    /// The ID to write into a native file [default: the file's name, with the camera's]
    #[arg(long, value_name = "ID")]
    id: Option<String>,
    /// Output file [default: standard output]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Writes one camera. Properties that the target format does not support are listed on standard
/// error.
fn convert(arguments: &ConvertArguments) -> anyhow::Result<ExitCode> {
    let path = arguments.source.file.display();
    let id = arguments.id.as_deref().map(str::parse).transpose();
    let (native, notes) = arguments.source.read_native(id.context("--id")?.as_ref())?;
    let exported = arguments.to.write(&native)?;
    let notes = notes.iter().map(ToString::to_string);
    for note in notes.chain(exported.lost) {
        eprintln!("lookdown: {path}: {note}");
    }
    write_or_print("--out", arguments.out.as_deref(), &exported.content)?;
    Ok(ExitCode::SUCCESS)
}

/// Arguments of `lookdown calibration height`.
#[derive(Debug, Args)]
pub(super) struct HeightArguments {
    #[command(flatten)]
    source: Source,
    /// Frames of the camera with people who stand: JPEG, PNG or WebP, all of one size.
    /// They may be left out with --reports
    #[arg(required_unless_present = "reports", value_name = "FRAME")]
    frames: Vec<PathBuf>,
    /// A file of reports of `lookdown detect` with this calibration, one per line. May be repeated
    #[arg(long, value_name = "FILE.jsonl")]
    reports: Vec<PathBuf>,
    /// Output file [default: standard output]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    settings_file: SettingsFile,
}

/// Writes the calibration with the height of the camera.
fn height(arguments: &HeightArguments) -> anyhow::Result<ExitCode> {
    let path = arguments.source.file.display();
    let (mut native, _) = arguments.source.read_native(None)?;
    let frames = match arguments.frames.as_slice() {
        [] => Vec::new(),
        paths => read_frames(paths)?.1,
    };
    let people = PeopleSource {
        frames: &frames,
        reports: &arguments.reports,
        settings: &arguments.settings_file,
    };
    set_height(&mut native, &people).with_context(|| path.to_string())?;
    write_native(&native, arguments.out.as_deref())?;
    Ok(ExitCode::SUCCESS)
}

/// Arguments of `lookdown calibration suggest-area`.
#[derive(Debug, Args)]
pub(super) struct SuggestAreaArguments {
    /// The camera
    #[arg(value_name = "CAMERA")]
    camera: String,
    /// The first time that counts, such as 2026-11-22T09:00:00Z [default: a day ago]
    #[arg(long, value_name = "TIME")]
    from: Option<String>,
    #[command(flatten)]
    server: ServerFlags,
}

/// The answer of `GET /counts/{camera}/suggested-area`.
#[derive(Deserialize)]
struct SuggestedArea {
    floor_m: Vec<[f64; 2]>,
}

/// Prints the field `areas` of a calibration.
fn suggest_area(arguments: &SuggestAreaArguments) -> anyhow::Result<ExitCode> {
    let area = for_this_thread()?.block_on(suggested_area(arguments))?;
    eprintln!(
        "lookdown: the floor on which people walked, and 0.5 m around it: check it in Zones of the \
         web page"
    );
    let areas = json!([{ "floor_m": area.floor_m }]);
    writeln!(io::stdout(), "\"areas\": {areas}").context(UNWRITABLE)?;
    Ok(ExitCode::SUCCESS)
}

async fn suggested_area(arguments: &SuggestAreaArguments) -> anyhow::Result<SuggestedArea> {
    let client = arguments.server.client()?;
    let mut url = client.route(["counts", &arguments.camera, "suggested-area"]);
    if let Some(from) = &arguments.from {
        url.query_pairs_mut().append_pair("from", from);
    }
    read_json(&client, url, "suggested area").await
}
