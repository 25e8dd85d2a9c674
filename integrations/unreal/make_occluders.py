"""Give the selected static meshes an occluder, made by the ``occluder`` command.

Run in the editor, by Tools > Execute Python Script or on its command line:

    py make_occluders.py --budget 64 --options="--preset best"

Unreal's software occlusion draws a level of detail of a mesh; so the occluder becomes its last one,
which is never drawn on the screen, and "LOD for Occluder Mesh" names it.  Meshes go out and come
back as GLB, by Unreal's own exporter and importer: they turn axes and units, both ways.
"""

import argparse
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import unreal

_TAG = "PlanarOccluderLod"
"""On a mesh that has an occluder: its level, so that a second run replaces that and no other."""

_NO_WINDOW = getattr(subprocess, "CREATE_NO_WINDOW", 0)  # Windows alone has one to hide


class OccluderError(Exception):
    """No occluder came of it; the text says why."""


def main(arguments):
    """The number of meshes that have an occluder now."""
    parser = argparse.ArgumentParser(prog="make_occluders.py")
    parser.add_argument("--command", default="occluder", help="its path, where it is not on PATH")
    parser.add_argument("--budget", type=int, default=64, help="most triangles of an occluder")
    parser.add_argument("--options", default="", help="further ones of 'occluder simplify'")
    chosen = parser.parse_args(arguments)
    program = shutil.which(chosen.command)
    if program is None:
        unreal.log_error(f"there is no command '{chosen.command}': name its path by --command")
        return 0
    command = [program, "simplify", "--budget", str(chosen.budget), *shlex.split(chosen.options)]
    selected = unreal.EditorUtilityLibrary.get_selected_assets()
    meshes = [asset for asset in selected if isinstance(asset, unreal.StaticMesh)]
    if not meshes:
        unreal.log_warning("select static meshes in the content browser")
    made = 0
    with unreal.ScopedSlowTask(len(meshes), "Making occluders") as task:
        task.make_dialog(True)
        for mesh in meshes:
            if task.should_cancel():
                break
            task.enter_progress_frame(1, mesh.get_name())
            try:
                make_occluder(mesh, command)
                made += 1
            except OccluderError as error:
                unreal.log_error(f"{mesh.get_path_name()}: {error}")
    return made


def make_occluder(mesh, command):
    """Make the last level of a static mesh its occluder.  Raises OccluderError."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder, "mesh.glb")
        target = Path(folder, f"{mesh.get_name()}_Occluder.glb")
        unreal.GLTFExporter.export_to_gltf(mesh, str(source), unreal.GLTFExportOptions(), set())
        if not source.exists():
            raise OccluderError("Unreal exported nothing: is the plugin 'glTF Exporter' enabled?")
        done = subprocess.run(
            [*command, source, "-o", target], capture_output=True, text=True, check=False,
            stdin=subprocess.DEVNULL, creationflags=_NO_WINDOW,
        )  # fmt: skip
        if done.returncode != 0:
            said = done.stderr.strip().splitlines()
            raise OccluderError(said[-1] if said else f"the command's status was {done.returncode}")
        place = f"{mesh.get_path_name().rpartition('/')[0]}/{mesh.get_name()}_OccluderImport"
        try:
            _set_occluder(mesh, _imported(target, place))
        finally:
            unreal.EditorAssetLibrary.delete_directory(place)


def _imported(path, place):
    """The static mesh of a file, in a folder of its own: the importer may add materials."""
    task = unreal.AssetImportTask()
    for name, value in {
        "filename": str(path), "destination_path": place,
        "automated": True, "replace_existing": True, "save": False,
    }.items():  # fmt: skip
        task.set_editor_property(name, value)
    unreal.AssetToolsHelpers.get_asset_tools().import_asset_tasks([task])
    for found in task.get_editor_property("imported_object_paths"):
        asset = unreal.load_asset(found)
        if isinstance(asset, unreal.StaticMesh):
            return asset
    raise OccluderError("Unreal imported no mesh of the command's GLB")


def _set_occluder(mesh, occluder):
    meshes = unreal.get_editor_subsystem(unreal.StaticMeshEditorSubsystem)
    library = unreal.EditorAssetLibrary
    earlier = library.get_metadata_tag(mesh, _TAG)
    level = int(earlier) if earlier else meshes.get_lod_count(mesh)
    if meshes.set_lod_from_static_mesh(mesh, level, occluder, 0, True) != level:
        raise OccluderError(f"Unreal did not take the occluder as level {level}")
    # At a screen size of 0 it is never chosen to be drawn.
    sizes = [*list(meshes.get_lod_screen_sizes(mesh))[:level], 0.0]
    meshes.set_lod_screen_sizes(mesh, sizes)
    mesh.set_editor_property("lod_for_occluder_mesh", level)
    library.set_metadata_tag(mesh, _TAG, str(level))
    library.save_loaded_asset(mesh)


if __name__ == "__main__":
    main(sys.argv[1:])
