"""The manifests for Kubernetes, as far as that is seen without a cluster.

The schema of Kubernetes judges all but the fields that KubeRay adds; those that are used are held
to a schema of their own below, and their pods to that of Kubernetes.
"""

from __future__ import annotations

import os
import re
import subprocess
import time
import tomllib
from dataclasses import dataclass

import httpx
import jsonschema
import kubernetes_validate
import pytest
import yaml

from service.errors import SettingsError
from service.settings import read_settings, unknown_settings
from service.storage.opening import check_for_worker, check_together
from simplifier.cli.main import COMMAND_GROUP, OWN
from tests.acceptance.command import OCCLUDER, ROOT, environment
from tests.service.declared import declare
from tests.waiting import BUSY, until

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
KNOWN = {*OWN, *PROJECT["entry-points"][COMMAND_GROUP]}
FOLDER = ROOT / "docker" / "kubernetes"
FILES = sorted(FOLDER.glob("*.yaml"))
START = ["/opt/occluder/env/bin/occluder"]
OURS = ("planar-occluder", "planar-occluder-ray")
QUANTITY = {"Mi": 1 << 20, "Gi": 1 << 30}


def documents():
    """What the cluster would be told, with where it stands."""
    for file in FILES:
        if file.name != "kustomization.yaml":
            for one in yaml.safe_load_all(file.read_text()):
                yield f"{file.name} {one['kind']} {one['metadata']['name']}", one


DOCUMENTS = dict(documents())
RAY_CLUSTER = next(one for one in DOCUMENTS.values() if one["kind"] == "RayCluster")


def pods():
    """Templates of pods, by where they stand."""
    for where, one in DOCUMENTS.items():
        if one["kind"] in ("Deployment", "Job"):
            yield where, one["spec"]["template"]
        elif one["kind"] == "RayCluster":
            yield f"{where} head", one["spec"]["headGroupSpec"]["template"]
            for group in one["spec"]["workerGroupSpecs"]:
                yield f"{where} {group['groupName']}", group["template"]


PODS = dict(pods())


@dataclass(frozen=True)
class Container:
    pod: dict
    itself: dict

    @property
    def command(self):
        """What of ``occluder`` it runs in the end; empty for another program."""
        said = [*self.itself.get("command", START), *self.itself.get("args", [])]
        words = " ".join(said)
        return words.partition(" ".join(START))[2].split()

    @property
    def variables(self):
        """As the cluster would set them; of secrets a value of their form."""
        found = {}
        for source in self.itself.get("envFrom", []):
            found |= SETTINGS[source["configMapRef"]["name"]]
        for one in self.itself.get("env", []):
            secret = one.get("valueFrom", {}).get("secretKeyRef")
            found[one["name"]] = one["value"] if secret is None else SECRETS[secret["name"]][
                secret["key"]
            ]  # fmt: skip
        return found


SETTINGS = {
    one["metadata"]["name"]: one["data"] for one in DOCUMENTS.values() if one["kind"] == "ConfigMap"
}
SECRETS = {
    "occluder-database": {"url": "postgresql://occluder:secret@db.example.org/occluder"},
    "occluder-bucket": {"access_key_id": "occluder", "secret_access_key": "secret"},
    "occluder-signing": {"secret": "of a file"},
    "occluder-ray": {"token": "secret"},
}
CONTAINERS = {
    f"{where} {one['name']}": Container(pod["spec"], one)
    for where, pod in PODS.items()
    for one in [*pod["spec"].get("initContainers", []), *pod["spec"]["containers"]]
}
COMMANDS = {where: one for where, one in CONTAINERS.items() if one.command}


def test_they_are_all_that_was_asked_for():
    commands = sorted(one.command[0] for one in COMMANDS.values())
    assert commands == ["dispatch", "migrate", "serve", "work"]
    kinds = {one["kind"] for one in DOCUMENTS.values()}
    assert {"PodDisruptionBudget", "Service", "RayCluster", "Job", "Deployment"} <= kinds


@pytest.mark.parametrize("where", [one for one in DOCUMENTS if "RayCluster" not in one])
def test_kubernetes_knows_each_field(where):
    """Of an older release and of the newest that the package has."""
    for version in ("1.34", kubernetes_validate.latest_version()):
        kubernetes_validate.validate(DOCUMENTS[where], version, strict=True)


TEMPLATE = {"type": "object"}
PARAMETERS = {"type": "object", "additionalProperties": {"type": "string"}}
RAY_SCHEMA = {
    "type": "object",
    "additionalProperties": False,
    "required": ["apiVersion", "kind", "metadata", "spec"],
    "properties": {
        "apiVersion": {"const": "ray.io/v1"},
        "kind": {"const": "RayCluster"},
        "metadata": {"type": "object"},
        "spec": {
            "type": "object",
            "additionalProperties": False,
            "required": ["headGroupSpec"],
            "properties": {
                "headGroupSpec": {
                    "type": "object",
                    "additionalProperties": False,
                    "required": ["template"],
                    "properties": {"rayStartParams": PARAMETERS, "template": TEMPLATE},
                },
                "workerGroupSpecs": {
                    "type": "array",
                    "items": {
                        "type": "object",
                        "additionalProperties": False,
                        "required": ["groupName", "minReplicas", "maxReplicas", "template"],
                        "properties": {
                            "groupName": {"type": "string"},
                            "replicas": {"type": "integer", "minimum": 0},
                            "minReplicas": {"type": "integer", "minimum": 0},
                            "maxReplicas": {"type": "integer", "minimum": 1},
                            "rayStartParams": PARAMETERS,
                            "template": TEMPLATE,
                        },
                    },
                },
            },
        },
    },
}
"""Of RayCluster in ray.io/v1 (KubeRay, ray-operator/config/crd) the fields that are used here."""


def test_kuberay_knows_each_field_of_its_own():
    jsonschema.validate(RAY_CLUSTER, RAY_SCHEMA)
    slip = {**RAY_CLUSTER, "spec": {**RAY_CLUSTER["spec"], "workerGroupSpec": []}}
    with pytest.raises(jsonschema.ValidationError, match="workerGroupSpec"):
        jsonschema.validate(slip, RAY_SCHEMA)


@pytest.mark.parametrize("where", [one for one in PODS if "RayCluster" in one])
def test_kubernetes_knows_each_field_of_the_pods_of_ray(where):
    pod = {"apiVersion": "v1", "kind": "Pod", "metadata": {"name": "ray"}, **PODS[where]}
    kubernetes_validate.validate(pod, kubernetes_validate.latest_version(), strict=True)


@pytest.mark.parametrize("where", PODS)
def test_a_pod_is_nobody_in_particular_and_reaches_nothing_of_the_cluster(where):
    spec = PODS[where]["spec"]
    assert spec["automountServiceAccountToken"] is False
    assert spec["securityContext"]["runAsNonRoot"] is True
    assert spec["securityContext"]["runAsUser"] == spec["securityContext"]["fsGroup"] == 10001
    assert spec["securityContext"]["seccompProfile"] == {"type": "RuntimeDefault"}


@pytest.mark.parametrize("where", CONTAINERS)
def test_a_container_may_do_little_and_takes_what_it_says(where):
    one = CONTAINERS[where].itself
    assert one["image"] in OURS
    assert one["securityContext"] == {
        "allowPrivilegeEscalation": False, "readOnlyRootFilesystem": True,
        "capabilities": {"drop": ["ALL"]},
    }  # fmt: skip
    assert {"cpu", "memory"} <= one["resources"]["requests"].keys()
    assert size(one["resources"]["requests"]["memory"]) <= size(
        one["resources"]["limits"]["memory"]
    )
    volumes = {volume["name"] for volume in CONTAINERS[where].pod.get("volumes", [])}
    mounts = {mount["name"]: mount["mountPath"] for mount in one.get("volumeMounts", [])}
    assert mounts.keys() <= volumes
    if CONTAINERS[where].command:  # what a job writes, and kernels; the root is not written to
        assert {"/data", "/tmp"} <= set(mounts.values())


def size(text):
    return int(text[:-2]) * QUANTITY[text[-2:]]


def test_secrets_are_named_and_not_contained():
    assert not any(one["kind"] == "Secret" for one in DOCUMENTS.values())
    for one in CONTAINERS.values():
        for variable in one.itself.get("env", []):
            secret = re.search("URL|TOKEN|ACCESS_KEY", variable["name"])
            plain = variable["name"] == "OCCLUDER_PUBLIC_URL"
            assert bool(secret and not plain) == ("valueFrom" in variable), variable["name"]
    text = "".join(file.read_text() for file in FILES)
    assert not re.search(r"postgresql://\w", text)
    made = re.findall(r"create secret generic (\S+)", text)
    assert sorted(made) == sorted(SECRETS)


def test_each_selector_finds_its_pods():
    labels = [pod["metadata"]["labels"] for pod in PODS.values()]
    for where, one in DOCUMENTS.items():
        selector = one["spec"].get("selector") if "spec" in one else None
        if selector:
            wanted = selector.get("matchLabels", selector)
            assert sum(wanted.items() <= known.items() for known in labels) == 1, where


def test_kustomize_takes_all_but_ray_and_names_the_image():
    top = yaml.safe_load((FOLDER / "kustomization.yaml").read_text())
    rest = {file.name for file in FILES} - {"kustomization.yaml", "ray.yaml"}
    assert set(top["resources"]) == rest
    assert [one["name"] for one in top["images"]] == [OURS[0]]
    assert {top["namespace"]} == {
        one["metadata"]["namespace"] for where, one in DOCUMENTS.items() if where.startswith("ray.")
    }


def test_the_server_is_asked_where_it_listens():
    image = (ROOT / "docker" / "Dockerfile").read_text()
    web = COMMANDS["web.yaml Deployment occluder-web web"].itself
    ports = {port["name"]: port["containerPort"] for port in web["ports"]}
    assert f"OCCLUDER_PORT={ports['http']} " in image
    probes = [one["httpGet"] for name, one in web.items() if name.endswith("Probe")]
    assert [one["path"] for one in probes] == ["/healthz", "/healthz", "/readyz"]
    assert {one["port"] for one in probes} == {"http"}


@pytest.mark.parametrize("where", COMMANDS)
def test_each_command_is_set_up_as_it_has_to_be(monkeypatch, where):
    container = COMMANDS[where]
    command, *arguments = container.command
    if command not in KNOWN:
        pytest.skip(f"'occluder {command}' is not of this release")
    if command == "warmup":
        assert not arguments
        return
    for variable, value in container.variables.items():
        monkeypatch.setenv(variable, value)
    settings = read_settings({})
    assert not list(unknown_settings())
    assert settings.database_url
    assert settings.blobs
    if command == "serve":
        check_together(settings)
    if command == "work":
        check_for_worker(settings)
        room = settings.workers * settings.job_memory
        assert room < size(container.itself["resources"]["limits"]["memory"])


def test_a_slip_in_a_value_is_refused(monkeypatch):
    """So that the test above would hear of one."""
    variables = COMMANDS["workers.yaml Deployment occluder-workers worker"].variables
    for variable, value in {**variables, "OCCLUDER_WORKERS": "two"}.items():
        monkeypatch.setenv(variable, value)
    with pytest.raises(SettingsError, match="OCCLUDER_WORKERS cannot be 'two'"):
        read_settings({})


@pytest.fixture
def set_up(postgres, moto, tmp_path_factory):
    """``set_up(container)``: its variables, with a database, a bucket and folders of this machine
    in the place of those that the cluster has."""
    address = postgres.database()
    folder = tmp_path_factory.mktemp("pods")
    declared = os.pathsep.join([str(declare(folder / "declared")), str(ROOT)])
    bucket = f"s3://{moto.new_bucket()}/production"

    def variables(name):
        container = COMMANDS[name]
        return {
            **container.variables, **moto.variables, "OCCLUDER_DATABASE_URL": address,
            "OCCLUDER_BLOBS": bucket, "OCCLUDER_DATA": str(folder / container.command[0]),
            "OCCLUDER_HOST": "127.0.0.1", "OCCLUDER_PORT": "0", "PYTHONPATH": declared,
            "OCCLUDER_WORKERS": "1",
        }  # fmt: skip

    yield variables
    postgres.drop(address)


@pytest.mark.slow
def test_the_commands_start_answer_and_end_in_the_time_that_they_are_given(set_up, tmp_path):
    migrate = "migrate.yaml Job occluder-migrate migrate"
    done = subprocess.run(
        [*OCCLUDER, *COMMANDS[migrate].command], env=environment(**set_up(migrate)),
        capture_output=True, text=True, timeout=BUSY, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    name = "web.yaml Deployment occluder-web web"
    variables = {**set_up(name), "OCCLUDER_SECRET_FILE": str(own_secret(tmp_path))}
    with started(name, variables) as (server, line):
        address = line.split()[-1]
        probes = COMMANDS[name].itself
        for probe in ("startupProbe", "livenessProbe", "readinessProbe"):
            url = address + probes[probe]["httpGet"]["path"]
            until(lambda url=url: httpx.get(url).status_code == 200, BUSY)
        assert ended(server) < grace_of(name)
    name = "workers.yaml Deployment occluder-workers worker"
    with started(name, set_up(name)) as (worker, line):
        assert line.startswith("occluder works")
        assert ended(worker) < grace_of(name)
    assert (server.returncode, worker.returncode) == (0, 0)


def own_secret(folder):
    """What the container before the server makes of the file that the cluster mounts."""
    found = CONTAINERS["web.yaml Deployment occluder-web own-secret"].itself["command"]
    mounted, own = folder / "mounted", folder / "own"
    mounted.write_bytes(os.urandom(32))
    mounted.chmod(0o440)
    places = {"/mnt/signing/secret": mounted, "/run/occluder/secret": own}
    subprocess.run([places.get(word, word) for word in found], check=True)
    return own


class started:
    """A block with the process of a container's command, and its first line."""

    def __init__(self, name, variables):
        self._process = subprocess.Popen(
            [*OCCLUDER, *COMMANDS[name].command], env=environment(**variables), text=True,
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
        )  # fmt: skip

    def __enter__(self):
        return self._process, self._process.stdout.readline()

    def __exit__(self, *error):
        self._process.kill()
        self._process.wait()
        self._process.stdout.close()


def ended(process):
    """Seconds that it takes to end once it is told to."""
    begin = time.monotonic()
    process.terminate()
    process.wait(BUSY)
    return time.monotonic() - begin


def grace_of(name):
    return COMMANDS[name].pod["terminationGracePeriodSeconds"]
