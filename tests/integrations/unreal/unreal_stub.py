"""What the script uses of Unreal's Python, as its documentation says that it behaves.

A static mesh is a list of levels, each vertices in centimetres, left-handed, +z up, and faces.  GLB
is in metres, right-handed, +y up: (x, y, z) of Unreal is (x, z, y) / 100 there, which mirrors, so
that faces are turned over as well.
"""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import numpy as np

import simplifier


class StaticMesh:
    def __init__(self, path, vertices, faces):
        self.path, self.levels = path, [(np.asarray(vertices, float), np.asarray(faces, np.int32))]
        self.sizes, self.properties, self.tags, self.saved = [1.0], {}, {}, 0

    def get_name(self):
        return self.path.rpartition("/")[2]

    def get_path_name(self):
        return f"{self.path}.{self.get_name()}"

    def set_editor_property(self, name, value):
        self.properties[name] = value


class Material:
    """Something else that may be selected, or imported."""


class AssetImportTask:
    def __init__(self):
        self._values = {}

    def set_editor_property(self, name, value):
        self._values[name] = value

    def get_editor_property(self, name):
        return self._values[name]


class ScopedSlowTask:
    cancel_after = None

    def __init__(self, work, text):
        self.done = 0

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def make_dialog(self, can_cancel):
        assert can_cancel

    def should_cancel(self):
        return self.cancel_after is not None and self.done >= self.cancel_after

    def enter_progress_frame(self, work, text):
        self.done += work


class StaticMeshEditorSubsystem:
    def get_lod_count(self, mesh):
        return len(mesh.levels)

    def set_lod_from_static_mesh(self, mesh, level, source, source_level, reuse_slots):
        assert reuse_slots
        if level > len(mesh.levels):
            return -1
        mesh.levels[level:] = [source.levels[source_level], *mesh.levels[level + 1 :]]
        mesh.sizes = [*mesh.sizes, 0.1][: len(mesh.levels)]
        return level

    def get_lod_screen_sizes(self, mesh):
        return mesh.sizes

    def set_lod_screen_sizes(self, mesh, sizes):
        assert len(sizes) == len(mesh.levels)
        mesh.sizes = sizes
        return True


def make_unreal(selected):
    """The module, with what is selected; ``assets`` are those that an import has made."""
    module = ModuleType("unreal")
    module.assets, module.errors, module.warnings = {}, [], []
    module.StaticMesh, module.Material = StaticMesh, Material
    module.AssetImportTask, module.ScopedSlowTask = AssetImportTask, ScopedSlowTask
    module.StaticMeshEditorSubsystem = StaticMeshEditorSubsystem
    module.GLTFExportOptions = type("GLTFExportOptions", (), {})
    module.get_editor_subsystem = lambda kind: kind()
    module.load_asset = module.assets.get
    module.log_error, module.log_warning = module.errors.append, module.warnings.append

    class GLTFExporter:
        @staticmethod
        def export_to_gltf(mesh, path, options, actors):
            vertices, faces = mesh.levels[0]
            turned = vertices[:, [0, 2, 1]] / 100.0
            simplifier.save(simplifier.Occluder(turned, faces[:, ::-1]), path)

    class AssetTools:
        @staticmethod
        def import_asset_tasks(tasks):
            (task,) = tasks
            read = simplifier.load(task.get_editor_property("filename"))
            place = task.get_editor_property("destination_path")
            path = f"{place}/{Path(task.get_editor_property('filename')).stem}"
            module.assets[f"{place}/Material"] = Material()
            module.assets[path] = StaticMesh(
                path, read.vertices[:, [0, 2, 1]] * 100.0, read.faces[:, ::-1]
            )
            task.set_editor_property("imported_object_paths", [f"{place}/Material", path])

    class EditorAssetLibrary:
        @staticmethod
        def get_metadata_tag(mesh, name):
            return mesh.tags.get(name, "")

        @staticmethod
        def set_metadata_tag(mesh, name, value):
            mesh.tags[name] = value

        @staticmethod
        def save_loaded_asset(mesh):
            mesh.saved += 1

        @staticmethod
        def delete_directory(place):
            for path in [one for one in module.assets if one.startswith(f"{place}/")]:
                del module.assets[path]

    class AssetToolsHelpers:
        get_asset_tools = staticmethod(lambda: AssetTools)

    class EditorUtilityLibrary:
        get_selected_assets = staticmethod(lambda: selected)

    module.GLTFExporter, module.EditorAssetLibrary = GLTFExporter, EditorAssetLibrary
    module.AssetToolsHelpers, module.EditorUtilityLibrary = AssetToolsHelpers, EditorUtilityLibrary
    return module
