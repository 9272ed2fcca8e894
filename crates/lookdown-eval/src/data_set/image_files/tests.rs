//! Tests of the lookup of images.

use super::*;

/// A folder with empty files.
fn folder(files: &[&str]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for file in files {
        let path = folder.path().join(file);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, "").unwrap();
    }
    folder
}

fn image_files(folder: &tempfile::TempDir) -> ImageFileIndex {
    Files::below(folder.path()).unwrap().image_files()
}

#[test]
fn an_image_is_found_by_its_name_in_any_folder() {
    let folder = folder(&["deep/er/a.jpg", "b.PNG", "a.txt"]);
    let image_files = image_files(&folder);
    let found = image_files.by_file_name(Path::new("a.jpg")).unwrap();
    assert!(found.ends_with("deep/er/a.jpg"));
    let found = image_files
        .by_file_name(Path::new("elsewhere/b.PNG"))
        .unwrap();
    assert!(found.ends_with("b.PNG"));
    let problem = image_files.by_file_name(Path::new("c.jpg")).unwrap_err();
    assert_eq!(problem, "no image c.jpg was found");
}

#[test]
fn equal_names_are_resolved_by_folder_or_refused() {
    let folder = folder(&["one/a.jpg", "two/a.jpg", "three/a.png"]);
    let image_files = image_files(&folder);
    let found = image_files.by_file_name(Path::new("two/a.jpg")).unwrap();
    assert!(found.ends_with("two/a.jpg"));
    let problem = image_files.by_file_name(Path::new("a.jpg")).unwrap_err();
    assert!(problem.contains("one/a.jpg") && problem.contains("two/a.jpg"));
    // In the folder of its annotations, an image's name is unambiguous.
    let beside = folder.path().join("three/a.xml");
    assert!(
        image_files
            .named_like(&beside)
            .unwrap()
            .ends_with("three/a.png")
    );
    let like_named = folder.path().join("annotations/t_wo/a.xml");
    let found = image_files.named_like(&like_named).unwrap();
    assert!(found.ends_with("two/a.jpg"));
    let nowhere = folder.path().join("annotations/a.xml");
    assert!(image_files.named_like(&nowhere).is_err());
}

#[test]
fn a_dot_in_a_name_is_part_of_the_name() {
    let folder = folder(&[
        "omni/2015-05-12T12-42-29.320Z.jpg",
        "omni/2015-05-12T12-42-29.jpg",
    ]);
    let annotations = folder.path().join("xml/2015-05-12T12-42-29.320Z.xml");
    let found = image_files(&folder).named_like(&annotations).unwrap();
    assert!(found.ends_with("omni/2015-05-12T12-42-29.320Z.jpg"));
}

#[test]
fn too_many_levels_of_folders_are_refused() {
    let deep = "x/".repeat(MAX_DEPTH + 1) + "a.jpg";
    let folder = folder(&[&deep]);
    let error = Files::below(folder.path()).map(|_| ()).unwrap_err();
    assert!(error.to_string().contains("levels of folders"), "{error}");
}
