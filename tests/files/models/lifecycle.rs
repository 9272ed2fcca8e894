//! Loading and reloading of models, and the state after failures.

use std::{
    fs,
    num::NonZeroUsize,
    sync::{
        Arc, Barrier,
        atomic::{AtomicBool, Ordering},
    },
    thread,
};

use lookdown::settings::explain;
use lookdown_calibration::revision::sha256_of;
use lookdown_detect::{
    inference::{InferenceError, ModelFolder, ModelRepository, RepositoryError, RepositoryOptions},
    metrics::DetectMetrics,
};
use tempfile::TempDir;

use crate::models::folder::{fixture, model_of_two_sessions, write};

const OTHER_ORDER: &str = "[input]\nchannel_order = \"bgr\"";

/// Options for the models in a folder.
fn options_of(folder: &TempDir) -> RepositoryOptions {
    RepositoryOptions {
        folder: ModelFolder {
            path: folder.path().to_owned(),
            elsewhere: None,
        },
        warm_up_views: NonZeroUsize::new(3).unwrap(),
        explain,
    }
}

struct Models {
    repository: ModelRepository,
    metrics: Arc<DetectMetrics>,
    folder: TempDir,
}

impl Models {
    /// A repository with the models `a` and `b`.
    fn new() -> Self {
        let folder = TempDir::new().unwrap();
        for name in ["a", "b"] {
            write(&folder.path().join(name), name, "", &fixture("any_batch"));
        }
        let metrics = Arc::<DetectMetrics>::default();
        let (options, loader) = (options_of(&folder), Box::new(model_of_two_sessions));
        Self {
            repository: ModelRepository::new(options, loader, Arc::clone(&metrics)),
            metrics,
            folder,
        }
    }

    fn write(&self, name: &str, more: &str, onnx: &str) {
        write(&self.folder.path().join(name), name, more, &fixture(onnx));
    }

    fn revision(&self, name: &str) -> Option<String> {
        let model = self.repository.registry.get(name);
        model.map(|model| model.revision.clone())
    }

    fn counts(&self) -> (u64, u64) {
        let loads = &self.metrics.model_loads;
        let [succeeded, failed] =
            ["success", "failure"].map(|result| loads.with_label_values(&[result]).get());
        (succeeded, failed)
    }
}

#[test]
fn only_what_is_in_the_folder_can_be_loaded() {
    let models = Models::new();
    let long = "x".repeat(1000);
    for name in ["c", "", ".", "..", "../a", "a/../b", "/etc", &long] {
        let error = models.repository.load(name).err().unwrap();
        assert!(matches!(error, RepositoryError::Unknown { .. }), "{error}");
        assert!(error.to_string().ends_with("there are a, b") && error.to_string().len() < 200);
    }
    write(
        &models.folder.path().join("c"),
        "a",
        "",
        &fixture("any_batch"),
    );
    let error = models.repository.load("c").err().unwrap().to_string();
    assert!(error.contains("has the name \"a\""), "{error}");
}

#[test]
fn a_model_with_changed_files_is_replaced_once_they_are_stable() {
    let models = Models::new();
    models.repository.load("a").unwrap();
    let before = models.revision("a");
    models.repository.reload_changed();
    assert_eq!(models.counts(), (1, 0));

    models.write("a", OTHER_ORDER, "any_batch");
    models.repository.reload_changed();
    assert_eq!(models.revision("a"), before, "the files may still change");
    models.repository.reload_changed();
    let after = models.revision("a");
    assert_ne!(after, before);
    models.repository.reload_changed();
    models.repository.reload_changed();
    assert_eq!((models.revision("a"), models.counts()), (after, (2, 0)));
}

#[test]
fn a_model_that_fails_its_check_does_not_replace_the_old_one() {
    for (onnx, reason) in [
        ("external_in_a_branch", "tensors in other files"),
        ("huge_tensor", "a tensor of more than"),
        ("four_planes", "32-bit floats"),
        ("other_names", "\"dets\""),
        ("balloon", "the network failed"),
    ] {
        let models = Models::new();
        models.repository.load("a").unwrap();
        let before = models.revision("a");
        models.write("a", "", onnx);
        let error = models.repository.load("a").err().unwrap().to_string();
        assert!(error.contains(reason), "{error}");
        assert_eq!(models.revision("a"), before);
        // A refused model is not loaded again until its files change.
        models.repository.reload_changed();
        models.repository.reload_changed();
        assert_eq!(models.counts(), (1, 1));

        models.write("a", OTHER_ORDER, "any_batch");
        models.repository.reload_changed();
        models.repository.reload_changed();
        assert_ne!(models.revision("a"), before);
    }
}

#[test]
fn a_file_with_another_sum_is_refused_at_load_and_reload() {
    let models = Models::new();
    let sum = sha256_of(&fs::read(fixture("any_batch")).unwrap());
    let wanted = format!("sha256 = \"{sum}\"\n");
    models.write("a", &wanted, "any_batch");
    models.repository.load("a").unwrap();
    let before = models.revision("a");
    // Another model, as someone with access to the file alone would put it there.
    let file = models.folder.path().join("a/model.onnx");
    fs::copy(fixture("pairs"), &file).unwrap();
    models.repository.reload_changed();
    models.repository.reload_changed();
    assert_eq!(models.revision("a"), before);
    assert_eq!(models.counts(), (1, 1));
    let error = models.repository.load("a").err().unwrap().to_string();
    assert!(error.contains("its SHA-256 is"), "{error}");
    assert!(!error.contains('\n'), "{error}");
}

#[test]
fn a_model_with_deleted_files_stays_loaded() {
    let models = Models::new();
    models.repository.load("a").unwrap();
    fs::remove_dir_all(models.folder.path().join("a")).unwrap();
    models.repository.reload_changed();
    models.repository.reload_changed();
    assert!(models.revision("a").is_some());
    assert_eq!(models.counts(), (1, 0));
}

#[test]
fn an_invalid_manifest_is_reported_once_and_changes_nothing() {
    let models = Models::new();
    models.repository.load("a").unwrap();
    fs::write(models.folder.path().join("a/model.toml"), "name = ").unwrap();
    for _ in 0..4 {
        models.repository.reload_changed();
    }
    assert_eq!(models.counts(), (1, 1));
}

#[test]
fn one_model_is_loaded_at_a_time() {
    let Models { folder, .. } = Models::new();
    let steps = Arc::new(Barrier::new(2));
    let steps_of_load = Arc::clone(&steps);
    let repository = ModelRepository::new(
        options_of(&folder),
        Box::new(move |path| {
            steps_of_load.wait();
            steps_of_load.wait();
            model_of_two_sessions(path)
        }),
        Arc::default(),
    );
    thread::scope(|scope| {
        let loading = scope.spawn(|| repository.load("b"));
        steps.wait();
        let refused = repository.load("a").err().unwrap();
        assert!(matches!(refused, RepositoryError::Busy), "{refused}");
        assert!(repository.is_loading());
        steps.wait();
        loading.join().unwrap().unwrap();
    });
    assert!(!repository.is_loading());
}

#[test]
fn changed_files_are_retried_after_a_server_outage() {
    let models = Models::new();
    let folder = &models.folder;
    let is_unavailable = Arc::new(AtomicBool::new(false));
    let unavailable = Arc::clone(&is_unavailable);
    let repository = ModelRepository::new(
        options_of(folder),
        Box::new(move |path| {
            if unavailable.load(Ordering::Relaxed) {
                let (url, detail) = ("http://elsewhere".to_owned(), "silence".to_owned());
                return Err(InferenceError::Remote { url, detail });
            }
            model_of_two_sessions(path)
        }),
        Arc::clone(&models.metrics),
    );
    let before = repository.load("a").unwrap().revision.clone();
    models.write("a", OTHER_ORDER, "any_batch");
    is_unavailable.store(true, Ordering::Relaxed);
    repository.reload_changed();
    repository.reload_changed();
    assert_eq!(models.counts().1, 1);
    is_unavailable.store(false, Ordering::Relaxed);
    repository.reload_changed();
    repository.reload_changed();
    let now = repository.registry.get("a").unwrap();
    assert_ne!(now.revision, before);
}

#[test]
fn a_missing_model_file_is_reported_with_the_fetch_command() {
    let models = Models::new();
    fs::remove_file(models.folder.path().join("b/model.onnx")).unwrap();
    let error = models.repository.load("b").err().unwrap().to_string();
    assert!(error.contains("make models"), "{error}");
}
