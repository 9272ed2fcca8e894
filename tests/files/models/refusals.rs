//! Refused models and their error messages.

use std::{fs, os::unix::fs::symlink};

use lookdown_detect::inference::{
    Device, InferenceError, OnnxDetector, OnnxOptions, OpenVinoDevice,
};
use tempfile::TempDir;

use crate::models::folder::{fixture, library, load, options, refusal, write};

#[track_caller]
fn assert_says(message: &str, parts: &[&str]) {
    assert!(!message.contains('\n'), "{message:?} is more than a line");
    for part in parts {
        assert!(message.contains(part), "{message:?} does not say {part:?}");
    }
}

#[test]
fn a_model_that_refers_to_other_files_is_refused() {
    for onnx in [
        "external_initializer",
        "external_elsewhere",
        "external_in_a_branch",
        "external_sparse",
    ] {
        assert_says(
            &refusal(onnx, ""),
            &["model.onnx", "tensors in other files"],
        );
    }
    assert_says(&refusal("engine", ""), &["a compiled engine"]);
}

#[test]
fn a_model_with_oversized_tensors_is_refused() {
    assert_says(&refusal("huge_tensor", ""), &["a tensor of more than"]);
    assert_says(
        &refusal("wide_input", ""),
        &["height is 8192", "32 to 4096"],
    );
}

#[test]
fn a_model_without_an_image_input_is_refused_with_its_inputs() {
    let needed = "32-bit floats [views, 3, height, width]";
    assert_says(
        &refusal("four_planes", ""),
        &["\"images\"", "[-1, 4, 32, 48]", needed],
    );
    assert_says(&refusal("vector_input", ""), &["[-1, 10]", needed]);
    assert_says(&refusal("byte_input", ""), &["u8", needed]);
    assert_says(
        &refusal("two_inputs", ""),
        &["\"images\", \"sizes\"", "only input"],
    );
}

#[test]
fn outputs_that_fit_no_head_are_refused_with_their_shapes() {
    assert_says(
        &refusal("other_names", ""),
        &["\"dets\"", "\"confidence\"", "[output]"],
    );
    let yolox = "[output]\nhead = \"yolox\"\nperson_class = 0\nname = \"boxes\"";
    assert_says(&refusal("any_batch", yolox), &["\"boxes\"", "[output]"]);
}

#[test]
fn a_manifest_that_contradicts_its_model_is_refused() {
    for (onnx, more, parts) in [
        (
            "any_batch",
            "[input]\nwidth = 64",
            &["width is fixed at 48", "says 64"][..],
        ),
        (
            "any_batch",
            "[input]\nname = \"pixels\"",
            &["no input \"pixels\"", "\"images\""],
        ),
        (
            "any_batch",
            "[input]\nlayout = \"nhwc\"",
            &["[-1, 3, 32, 48]"],
        ),
        (
            "pairs",
            "[input]\nbatch = 4",
            &["2 views at once", "batch = 4"],
        ),
        ("any_size", "", &["width open", "`width`"]),
        (
            "any_size",
            "[input]\nwidth = 100\nheight = 96\nstride = 32",
            &["width is 100", "multiple of 32"],
        ),
        (
            "any_size",
            "[input]\nwidth = 8\nheight = 96",
            &["width is 8", "32 to 4096"],
        ),
        ("any_batch", "[input]\nstd = [0, 1, 1]", &["std of 0"]),
        ("any_batch", "[input]\nscale = [nan, 1, 1]", &["not finite"]),
        (
            "any_batch",
            "[input]\nscale = [1, 1, 1]\nmean = [1, 1, 1]",
            &["one pair"],
        ),
        (
            "any_batch",
            "[input]\nwidht = 48",
            &["line 4", "`widht`", "`width`"],
        ),
        (
            "any_batch",
            "[output]\nhead = \"magic\"",
            &["`magic`", "`yolox`"],
        ),
        (
            "any_batch",
            "sha256 = \"12\"",
            &["sha256", "64 hexadecimal digits"],
        ),
    ] {
        assert_says(&refusal(onnx, more), parts);
    }
}

#[test]
fn a_file_with_a_wrong_checksum_is_refused() {
    let sum = load("any_batch", "").unwrap().description.sha256.clone();
    load("any_batch", &format!("sha256 = \"{sum}\"")).unwrap();
    let other = format!("sha256 = \"{}\"", "0".repeat(64));
    assert_says(&refusal("any_batch", &other), &[&sum, &"0".repeat(64)]);
}

#[test]
fn a_file_outside_the_model_s_folder_is_refused() {
    let folder = TempDir::new().unwrap();
    let inside = folder.path().join("mine");
    write(&inside, "mine", "", &fixture("any_batch"));
    fs::copy(fixture("any_batch"), folder.path().join("model.onnx")).unwrap();
    symlink("../model.onnx", inside.join("link.onnx")).unwrap();
    let absolute = inside.join("model.onnx").display().to_string();
    for onnx in [
        "../model.onnx",
        "link.onnx",
        "x/../../model.onnx",
        &absolute,
    ] {
        let manifest = format!("name = \"mine\"\nonnx = \"{onnx}\"\n");
        fs::write(inside.join("model.toml"), manifest).unwrap();
        let error = OnnxDetector::load(&library(), &inside, &options())
            .err()
            .unwrap();
        assert_says(&error.to_string(), &[onnx, "the manifest's own folder"]);
    }
}

#[test]
fn a_file_that_is_not_onnx_is_refused() {
    let whole = fs::read(fixture("any_batch")).unwrap();
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("model.onnx");
    let contents: [&[u8]; 4] = [
        b"",
        b"not a model",
        &whole[..whole.len() - 40],
        &[0xff; 100],
    ];
    for content in contents {
        fs::write(&file, content).unwrap();
        let error = OnnxDetector::load(&library(), &file, &options())
            .err()
            .unwrap();
        assert_says(&error.to_string(), &["model.onnx", "not an ONNX model"]);
    }
    fs::write(&file, []).unwrap();
    fs::File::options()
        .write(true)
        .open(&file)
        .unwrap()
        .set_len((1 << 30) + 1)
        .unwrap();
    let error = OnnxDetector::load(&library(), &file, &options())
        .err()
        .unwrap();
    assert_says(&error.to_string(), &["more than 1024 MiB"]);
    let missing = folder.path().join("none.onnx");
    let error = OnnxDetector::load(&library(), &missing, &options())
        .err()
        .unwrap();
    assert_says(
        &error.to_string(),
        &["model: ", "none.onnx", "No such file"],
    );
}

#[test]
fn a_library_without_the_provider_of_a_device_refuses_it() {
    for device in [
        Device::Cuda(0),
        Device::TensorRt(1),
        Device::OpenVino(OpenVinoDevice::Cpu),
    ] {
        let options = OnnxOptions {
            device,
            ..options()
        };
        let error = OnnxDetector::load(&library(), &fixture("any_batch"), &options)
            .err()
            .unwrap();
        assert!(
            matches!(error, InferenceError::NoProvider { .. }),
            "{error}"
        );
        let parts = [&device.to_string(), device.package(), "use cpu"];
        assert_says(&error.to_string(), &parts);
    }
}
