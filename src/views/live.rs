//! The newest frame of a camera with views. Each view of a frame is rendered and encoded once, when
//! the first viewer needs it.

use std::{
    hash::{DefaultHasher, Hash, Hasher},
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::{Duration, Instant},
};

use bytes::Bytes;
use jiff::Timestamp;
use lookdown_calibration::CameraGeometry;
use lookdown_detect::{
    parameters::ParameterError,
    pipeline::{CalibrationUsed, DetectedFrame, JobImage},
};
use lookdown_imaging::{
    Frame, MaskedPixels, RemapTable,
    annotate::{
        Concealment, Drawing, EncodeError, Mark, ZoneOutline, annotate, conceal, encode_jpeg,
        sketch_line_outlines,
    },
    decode::{DecodeError, DecodeLimits, decode},
};
use lookdown_lens::geometry::OrientedBox;
use parking_lot::Mutex;
use tokio::sync::{OnceCell, Semaphore, watch};

use super::{
    follower::Follower,
    view::{Direction, Part, Projection, View, ViewKind, box_in_view, outlines_in_view},
};
use crate::annotated_image::marks_to_conceal;

/// Most views of a frame that are kept for further viewers, and most views of a camera whose remap
/// tables are kept: a table of 960 × 720 takes 100 KiB.
const MAX_KEPT: usize = 16;
/// Default quality of a JPEG: its loss is hardly visible in a moving image.
const QUALITY: u8 = 80;
/// The time after a frame from the camera for which frames of reports, which are older, wait.
const FED: Duration = Duration::from_secs(2);

/// A view cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// A value that does not fit the camera.
    #[error(transparent)]
    Invalid(#[from] ParameterError),
    /// The frame cannot be decoded.
    #[error("the frame cannot be decoded: {0}")]
    Decode(#[from] DecodeError),
    /// The view cannot be encoded.
    #[error("the view cannot be encoded: {0}")]
    Encode(#[from] EncodeError),
    /// The frame has another size than those of its camera.
    #[error(
        "the frame has another size than the last one with a report: the next report changes that"
    )]
    FrameSize,
    /// The process ends.
    #[error("the server is shutting down")]
    Ended,
}

/// A camera as its last report has it.
struct Scene {
    calibration: CalibrationUsed,
    size: [u32; 2],
    camera: CameraGeometry,
    masked: MaskedPixels,
    tables: Mutex<Vec<(View, Arc<Tables>)>>,
}

/// A view with its remap tables.
struct Tables {
    parts: Vec<Part>,
    /// A table for each part.
    remap: Vec<RemapTable>,
}

/// The way in which a view is written.
#[derive(Debug, Clone, PartialEq)]
pub struct Rendering {
    /// The view.
    pub view: View,
    /// Quality of the JPEG, 1 to 100.
    pub quality: u8,
    /// True to draw the boxes of the last report.
    pub boxes: bool,
    /// True to draw the zones with their names.
    pub zones: bool,
    /// True to draw the counting lines with their names.
    pub lines: bool,
    /// The number of persons to write.
    pub number: Option<usize>,
}

impl Rendering {
    /// Writes a view in the default quality, without drawings.
    pub fn new(view: View) -> Self {
        Self {
            view,
            quality: QUALITY,
            boxes: false,
            zones: false,
            lines: false,
            number: None,
        }
    }
}

/// A frame of a camera.
pub struct LiveFrame {
    /// The time at which it was captured.
    pub captured_at: Timestamp,
    shown: Instant,
    /// Its number, within those of the camera.
    number: u64,
    image: JobImage,
    scene: Arc<Scene>,
    /// The concealment of people, and their places in frame pixels.
    concealed: Option<(Concealment, Vec<Mark>)>,
    persons: Arc<Vec<OrientedBox>>,
    /// The axis of views that follow a person.
    followed: Option<Direction>,
    decoded: OnceCell<Arc<Frame>>,
    rendered: Mutex<Vec<(Rendering, Arc<OnceCell<Bytes>>)>>,
}

/// The camera and the people of a report.
type LastReport = (Arc<Scene>, Arc<Vec<OrientedBox>>);

/// The newest frame of a camera.
pub struct LiveCamera {
    newest: watch::Sender<Option<Arc<LiveFrame>>>,
    /// The camera and the people of its last report.
    last: Mutex<Option<LastReport>>,
    /// The time of the last frame without a report of its own.
    fed_at: Mutex<Option<Instant>>,
    follower: Mutex<Follower>,
    /// The number of frames so far.
    count: AtomicU64,
    workers: Arc<Semaphore>,
    limits: DecodeLimits,
}

impl LiveCamera {
    pub(super) fn new(workers: Arc<Semaphore>, limits: DecodeLimits) -> Self {
        Self {
            newest: watch::Sender::default(),
            last: Mutex::default(),
            fed_at: Mutex::default(),
            follower: Mutex::default(),
            count: AtomicU64::default(),
            workers,
            limits,
        }
    }

    /// Returns a receiver of the newest frame.
    pub fn frames(&self) -> watch::Receiver<Option<Arc<LiveFrame>>> {
        self.newest.subscribe()
    }

    /// Drops the newest frame.
    pub(super) fn forget(&self) {
        *self.last.lock() = None;
        *self.follower.lock() = Follower::default();
        self.newest.send_replace(None);
    }

    /// Notes a report. Its frame becomes the newest one, unless the camera delivers frames itself.
    pub(super) fn detected(
        &self,
        image: &JobImage,
        detected: &DetectedFrame,
        concealment: Option<Concealment>,
    ) {
        let Some(camera) = detected.camera() else {
            return;
        };
        let report = &detected.report;
        let size = [report.image_width, report.image_height];
        let persons = report.persons.iter().map(|person| person.oriented_box);
        let persons = Arc::new(persons.collect::<Vec<_>>());
        let mut last = self.last.lock();
        let known = last.as_ref().map(|(scene, _)| scene);
        let known =
            known.filter(|scene| scene.calibration == report.calibration && scene.size == size);
        let new = || {
            Arc::new(Scene {
                calibration: report.calibration.clone(),
                size,
                masked: MaskedPixels::new(&camera.areas.masks, size[0], size[1]),
                camera: camera.clone(),
                tables: Mutex::default(),
            })
        };
        let scene = known.map_or_else(new, Arc::clone);
        *last = Some((Arc::clone(&scene), Arc::clone(&persons)));
        self.follower.lock().update(&persons, camera);
        drop(last);
        let fed_at = *self.fed_at.lock();
        if fed_at.is_some_and(|at| at.elapsed() < FED) {
            return;
        }
        let concealed = concealment.map(|concealment| (concealment, marks_to_conceal(detected)));
        let captured_at = report.captured_at.unwrap_or(report.received_at);
        let image = kept(image, &detected.frame);
        self.show(image, captured_at, (scene, persons), concealed);
    }

    /// Shows a frame of the camera without a report of its own. Before the first report nothing is
    /// known about the camera, and the frame is dropped.
    pub(super) fn offer(&self, image: Bytes, captured_at: Timestamp) {
        let Some(last) = self.last.lock().clone() else {
            return;
        };
        *self.fed_at.lock() = Some(Instant::now());
        self.show(JobImage::Encoded(image), captured_at, last, None);
    }

    fn show(
        &self,
        image: JobImage,
        captured_at: Timestamp,
        (scene, persons): LastReport,
        concealed: Option<(Concealment, Vec<Mark>)>,
    ) {
        let frame = LiveFrame {
            captured_at,
            shown: Instant::now(),
            number: self.count.fetch_add(1, Ordering::Relaxed),
            image,
            scene,
            concealed,
            persons,
            followed: self.follower.lock().advance(),
            decoded: OnceCell::new(),
            rendered: Mutex::default(),
        };
        self.newest.send_replace(Some(Arc::new(frame)));
    }

    /// Checks that a view fits the camera, if its lens is known.
    ///
    /// # Errors
    /// [`ParameterError`] if the view is outside of the lens image.
    pub fn check(&self, view: &View) -> Result<(), ParameterError> {
        let last = self.last.lock();
        let Some((scene, _)) = &*last else {
            return Ok(());
        };
        view.parts(&view.direction(), &scene.camera).map(drop)
    }

    /// Returns the boxes of persons in a view of the newest frame: left, top, right and bottom,
    /// corner-origin pixels. `None` for a person outside of the view.
    ///
    /// # Errors
    /// [`ViewError::Invalid`] if the view is outside of the lens image.
    pub fn boxes(
        &self,
        view: &View,
        persons: &[OrientedBox],
    ) -> Result<Vec<Option<[f64; 4]>>, ViewError> {
        let Some(frame) = self.newest.borrow().clone() else {
            return Ok(vec![None; persons.len()]);
        };
        let camera = &frame.scene.camera;
        let parts = view.parts(&frame.direction(view), camera)?;
        let boxes = persons.iter();
        let boxes = boxes.map(|person| box_in_view(&parts, person, camera));
        Ok(boxes.collect())
    }

    /// Returns a view of a frame as JPEG.
    ///
    /// # Errors
    /// [`ViewError`].
    pub async fn jpeg(
        &self,
        frame: &Arc<LiveFrame>,
        rendering: &Rendering,
    ) -> Result<Bytes, ViewError> {
        let cell = frame.cell(rendering);
        let jpeg = cell.get_or_try_init(async || {
            let decoding = async || {
                let frame = Arc::clone(frame);
                let limits = self.limits;
                self.run(move || frame.decode(&limits)).await
            };
            let decoded = Arc::clone(frame.decoded.get_or_try_init(decoding).await?);
            let (frame, rendering) = (Arc::clone(frame), rendering.clone());
            self.run(move || frame.render(&decoded, &rendering)).await
        });
        jpeg.await.cloned()
    }

    /// Runs blocking work on one of the few threads of views.
    async fn run<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> Result<T, ViewError> + Send + 'static,
    ) -> Result<T, ViewError> {
        let permit = Arc::clone(&self.workers).acquire_owned().await;
        let permit = permit.map_err(|_| ViewError::Ended)?;
        let working = tokio::task::spawn_blocking(move || {
            let _permit = permit;
            work()
        });
        working.await.map_err(|_| ViewError::Ended)?
    }
}

impl LiveFrame {
    /// The time since the frame came.
    pub fn age(&self) -> Duration {
        self.shown.elapsed()
    }

    /// The entity tag of a view of this frame.
    pub fn tag(&self, rendering: &Rendering) -> String {
        let mut hasher = DefaultHasher::new();
        format!("{rendering:?}").hash(&mut hasher);
        let calibration = &self.scene.calibration;
        (&calibration.id, &calibration.revision, self.number).hash(&mut hasher);
        format!(
            "{:x}-{:x}",
            self.captured_at.as_nanosecond(),
            hasher.finish()
        )
    }

    /// The direction of a view in this frame.
    fn direction(&self, view: &View) -> Direction {
        let own = view.direction();
        match self.followed.filter(|_| view.kind == ViewKind::Follow) {
            Some(axis) if view.field_of_view_deg.is_some() => Direction {
                field_of_view: own.field_of_view,
                ..axis
            },
            Some(axis) => axis,
            None => own,
        }
    }

    fn cell(&self, rendering: &Rendering) -> Arc<OnceCell<Bytes>> {
        let mut rendered = self.rendered.lock();
        if let Some(cell) = known(&rendered, rendering) {
            return cell;
        }
        let cell = Arc::<OnceCell<Bytes>>::default();
        keep(&mut rendered, rendering.clone(), &cell);
        cell
    }

    /// Decodes the frame, with its masks and with people concealed.
    fn decode(&self, limits: &DecodeLimits) -> Result<Arc<Frame>, ViewError> {
        let mut frame = match &self.image {
            JobImage::Encoded(file) => Arc::new(decode(file, limits)?.frame),
            JobImage::Decoded(frame) => Arc::clone(frame),
        };
        if [frame.width(), frame.height()] != self.scene.size {
            return Err(ViewError::FrameSize);
        }
        if !self.scene.masked.is_empty() {
            self.scene.masked.blank(Arc::make_mut(&mut frame));
        }
        if let Some((concealment, marks)) = &self.concealed {
            let frame = Arc::make_mut(&mut frame);
            // Never cancelled: each viewer waits for it.
            let _ = conceal(frame, marks, *concealment, &|| false);
        }
        Ok(frame)
    }

    fn render(&self, frame: &Frame, rendering: &Rendering) -> Result<Bytes, ViewError> {
        let view = &rendering.view;
        let tables = match view.kind {
            // Its direction changes with each frame.
            ViewKind::Follow => Arc::new(self.scene.new_tables(view, &self.direction(view))?),
            _ => self.scene.tables(view)?,
        };
        let mut image = Frame::black(view.width, view.height);
        for (part, table) in tables.parts.iter().zip(&tables.remap) {
            table.paint(frame, part.size(), &mut image, part.origin);
        }
        self.draw(&mut image, &tables.parts, rendering);
        Ok(encode_jpeg(&image, rendering.quality)?.into())
    }

    /// Draws what the rendering has beside the view.
    fn draw(&self, image: &mut Frame, parts: &[Part], rendering: &Rendering) {
        let camera = &self.scene.camera;
        let (areas, lens, mount) = (&camera.areas, &camera.lens, &camera.mount);
        if rendering.lines {
            let lines = areas.lines.iter();
            let lines = lines.map(|line| ZoneOutline::for_line(line, lens, mount));
            let lines = outlines_in_view(parts, &lines.collect::<Vec<_>>(), camera);
            sketch_line_outlines(image, &lines);
        }
        let mut drawing = Drawing::new(Vec::new());
        drawing.oriented = false;
        if rendering.zones {
            let zones = areas.zones.iter();
            let zones = zones.map(|zone| ZoneOutline::new(zone, lens, mount));
            drawing.zones = outlines_in_view(parts, &zones.collect::<Vec<_>>(), camera);
        }
        if rendering.boxes {
            let boxes = self.persons.iter();
            let boxes = boxes.filter_map(|person| box_in_view(parts, person, camera));
            drawing.marks = boxes.map(|bbox| Mark::new(bbox, "")).collect();
        }
        if let Some(number) = rendering.number {
            drawing.caption = format!("Persons: {number}");
        }
        annotate(image, &drawing);
    }
}

/// Returns the kept value of a key.
fn known<K: PartialEq, V>(kept: &[(K, Arc<V>)], key: &K) -> Option<Arc<V>> {
    let (_, value) = kept.iter().find(|(known, _)| known == key)?;
    Some(Arc::clone(value))
}

/// Keeps a value, in place of the oldest one where there are too many.
fn keep<K, V>(kept: &mut Vec<(K, Arc<V>)>, key: K, value: &Arc<V>) {
    if kept.len() == MAX_KEPT {
        kept.remove(0);
    }
    kept.push((key, Arc::clone(value)));
}

/// Returns the smaller one of a file and its pixels. A file is copied, so that the rest of its
/// request body can be freed.
fn kept(image: &JobImage, pixels: &Arc<Frame>) -> JobImage {
    match image {
        JobImage::Encoded(file) if file.len() < pixels.pixels().len() => {
            JobImage::Encoded(Bytes::copy_from_slice(file))
        }
        _ => JobImage::Decoded(Arc::clone(pixels)),
    }
}

impl Scene {
    /// Returns the remap tables of a view.
    fn tables(&self, view: &View) -> Result<Arc<Tables>, ParameterError> {
        if let Some(tables) = known(&self.tables.lock(), view) {
            return Ok(tables);
        }
        let tables = Arc::new(self.new_tables(view, &view.direction())?);
        keep(&mut self.tables.lock(), view.clone(), &tables);
        Ok(tables)
    }

    fn new_tables(&self, view: &View, direction: &Direction) -> Result<Tables, ParameterError> {
        let parts = view.parts(direction, &self.camera)?;
        let remap = parts.iter().map(|part| self.table(&part.projection));
        Ok(Tables {
            remap: remap.collect(),
            parts,
        })
    }

    fn table(&self, projection: &Projection) -> RemapTable {
        let ([width, height], lens) = (self.size, &self.camera.lens);
        match projection {
            Projection::Pinhole(view) => {
                let view = std::slice::from_ref(view);
                let mut tables = RemapTable::for_views(view, lens, width, height);
                tables.remove(0)
            }
            Projection::Panorama(panorama) => {
                RemapTable::for_panorama(panorama, lens, width, height)
            }
        }
    }
}
