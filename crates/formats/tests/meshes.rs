//! Meshes of a URDF: their files, their formats, and the shapes of the links.

use std::fs;
use std::path::{Path, PathBuf};

use didim_formats::{MeshFolders, UrdfArm, UrdfGeometry};

/// A tetrahedron in several formats.
const STL: &str = "solid t
facet normal 0 0 0
outer loop
vertex 0 0 0
vertex 1 0 0
vertex 0 2 0
endloop
endfacet
facet normal 0 0 0
outer loop
vertex 0 0 0
vertex 0 0 3
vertex 1 0 0
endloop
endfacet
endsolid t
";
const OBJ: &str = "mtllib none.mtl
v 0 0 0
v 1 0 0
v 0 2 0
v 0 0 3
f 1 2 3
f 1 4 2
";
const DAE: &str = r##"<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="0.001" name="millimeter"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="12">0 0 0 1000 0 0 0 2000 0 0 0 3000</float_array>
<technique_common><accessor source="#a" count="4" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
</accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="2"><input semantic="VERTEX" source="#v" offset="0"/>
<p>0 1 2 0 3 1</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n">
<matrix>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</matrix>
<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene>
</COLLADA>
"##;

fn write(folder: &Path, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
    let file = folder.join(name);
    fs::create_dir_all(file.parent().unwrap()).unwrap();
    fs::write(&file, content).unwrap();
    file
}

fn extent(points: &[[f64; 3]]) -> [[f64; 2]; 3] {
    std::array::from_fn(|axis| {
        let along = || points.iter().map(|point| point[axis]);
        [along().fold(f64::INFINITY, f64::min), along().fold(f64::NEG_INFINITY, f64::max)]
    })
}

/// One file of each format; a COLLADA file has its own unit.
#[test]
fn points_of_meshes_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let folders = MeshFolders::new(&folder.path().join("arm.urdf"), &[]);
    for (name, content, x) in
        [("t.stl", STL, [0.0, 1.0]), ("t.OBJ", OBJ, [0.0, 1.0]), ("t.dae", DAE, [0.0, 1.0])]
    {
        write(folder.path(), name, content);
        let points = folders.read_points(name).unwrap();
        assert_eq!(points.len(), 4, "{name}");
        for (found, expected) in extent(&points).iter().zip([x, [0.0, 2.0], [0.0, 3.0]]) {
            let off = found.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off < 1e-6, "{name}: {found:?} {expected:?}");
        }
    }
}

/// A COLLADA file places its parts.
#[test]
fn parts_of_a_mesh_are_placed() {
    let folder = tempfile::tempdir().unwrap();
    let folders = MeshFolders::new(&folder.path().join("arm.urdf"), &[]);
    let metres = DAE.replace("0.001", "1").replace("<matrix>1 0 0 0 0", "<matrix>1 0 0 0.5 0");
    write(folder.path(), "t.dae", metres);
    let [x, ..] = extent(&folders.read_points("t.dae").unwrap());
    assert!((x[0] - 0.5).abs() < 1e-6 && (x[1] - 1000.5).abs() < 1e-3, "{x:?}");
}

/// In the folder of a package, or in a folder above the URDF that has another name.
#[test]
fn packages_are_searched_in_folders() {
    let folder = tempfile::tempdir().unwrap();
    let urdf = folder.path().join("ws/src/arm_v2/urdf/arm.urdf");
    let mesh = write(folder.path(), "ws/src/arm_v2/meshes/a.stl", STL);
    let tool = write(folder.path(), "other/tool/meshes/b.stl", STL);
    let other = [folder.path().join("other")];
    let (alone, with) = (MeshFolders::new(&urdf, &[]), MeshFolders::new(&urdf, &other));
    let absolute = format!("file://{}", mesh.display());
    for name in ["package://arm_v2/meshes/a.stl", "package://arm/meshes/a.stl", "meshes/a.stl"] {
        assert!(alone.read_points(name).is_ok(), "{name}");
    }
    assert!(alone.read_points(&absolute).is_ok() && tool.is_file());
    assert!(alone.read_points("package://tool/meshes/b.stl").unwrap_err().is_missing());
    assert!(with.read_points("package://tool/meshes/b.stl").is_ok());
}

/// None of them ends the program, and none gives points.
#[test]
fn damaged_meshes_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folders = MeshFolders::new(&folder.path().join("arm.urdf"), &[]);
    let twice = "<instance_geometry url=\"#g\"/><instance_geometry url=\"#g\"/>";
    let index = DAE.replace("0 3 1</p>", "0 9 1</p>");
    for (name, content) in [
        ("empty.stl", String::new()),
        ("cut.stl", STL[..STL.len() / 2].to_owned()),
        ("nan.stl", STL.replace("vertex 0 0 3", "vertex 0 0 nan")),
        ("index.dae", index),
        ("twice.dae", DAE.replace("<instance_geometry url=\"#g\"/>", twice)),
        ("shift.dae", DAE.replace("<matrix>1 0 0 0 0", "<matrix>1 0 0 500 0")),
        ("no.dae", "<COLLADA/>".to_owned()),
        ("unknown.xyz", "0 0 0".to_owned()),
        ("index.obj", OBJ.replace("f 1 4 2", "f 1 9 2")),
    ] {
        write(folder.path(), name, content);
        let error = folders.read_points(name).unwrap_err();
        assert!(!error.is_missing(), "{name}");
    }
}

/// `<collision>` counts, and `<visual>` where there is none.
#[test]
fn shapes_are_those_for_collisions_or_else_the_visible_ones() {
    let urdf = r#"<robot name="a"><link name="base">
        <visual><geometry><sphere radius="0.1"/></geometry></visual></link>
        <link name="arm"><visual><geometry><sphere radius="9"/></geometry></visual>
        <collision><origin xyz="0 0 0.5"/>
        <geometry><mesh filename="a.stl" scale="0.001 0.001 0.002"/></geometry></collision>
        <collision><geometry><cylinder radius="0.1" length="0.4"/></geometry></collision></link>
        <joint name="j" type="revolute"><parent link="base"/><child link="arm"/>
        <origin xyz="0 0 1"/><axis xyz="0 1 0"/>
        <limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"#;
    let arm = UrdfArm::read(urdf, None, None).unwrap();
    let [base, mesh, cylinder] = arm.shapes() else { panic!("{:?}", arm.shapes()) };
    assert_eq!((base.number, &base.geometry), (0, &UrdfGeometry::Sphere { radius_m: 0.1 }));
    let geometry = UrdfGeometry::Mesh { file: "a.stl".to_owned(), scale: [0.001, 0.001, 0.002] };
    assert_eq!((mesh.number, mesh.link.as_str(), &mesh.geometry), (1, "arm", &geometry));
    assert_eq!(cylinder.geometry, UrdfGeometry::Cylinder { radius_m: 0.1, length_m: 0.4 });
    // Seen from the base link, the base's shape is at its origin, 1 m below the axis.
    let in_base_link = arm.base_link_pose().inverse() * base.pose;
    assert!(in_base_link.translation.vector.norm() < 1e-12);
    // The mesh is 0.5 m along the link, which is not the axis of its joint.
    let offset = mesh.pose.translation.vector - cylinder.pose.translation.vector;
    assert!((offset.norm() - 0.5).abs() < 1e-12 && offset.z.abs() < 1e-12, "{offset}");
    assert!(arm.link_names().eq(["base", "arm"]) && arm.unread_shapes().is_empty());
}
