"""The OpenAPI document: complete, true to requests and responses, with valid examples."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from itertools import groupby
from typing import Any

import jsonschema_rs
import pytest
from starlette.testclient import TestClient

from joulepath import __version__
from joulepath.app.exceptions.error_types import types_of_error
from joulepath.app.main import create_app
from joulepath.app.settings import Settings
from tests.app.documents import open_document


@pytest.fixture
def document() -> dict[str, Any]:
    return open_document()


def properties(document: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Every property of every schema, by name."""
    for name, schema in document["components"]["schemas"].items():
        for field, content in schema.get("properties", {}).items():
            yield f"{name}.{field}", content


def named(node: Any, document: dict[str, Any]) -> set[str]:
    """Names of all schemas within a part of the document."""
    found, open_ = set[str](), [node]
    while open_:
        part = open_.pop()
        if isinstance(part, dict):
            name = str(part.get("$ref", "")).rpartition("/")[2]
            if name and name not in found:
                found.add(name)
                open_.append(document["components"]["schemas"][name])
        open_ += part.values() if isinstance(part, dict) else part if isinstance(part, list) else []
    return found


def is_number(schema: dict[str, Any]) -> bool:
    return '"number"' in repr(schema).replace("'", '"')


def is_composite(schema: dict[str, Any]) -> bool:
    return "$ref" in repr(schema)


def test_operations_have_names_for_generated_clients(document: dict[str, Any]) -> None:
    """Each id is unique and a name of a method, and tells what it does to what."""
    names = [
        (operation["operationId"], method, path)
        for path, operations in document["paths"].items()
        for method, operation in operations.items()
    ]
    assert len({name for name, _, _ in names}) == len(names)
    assert all(re.fullmatch(r"[a-z]+(_[a-z]+)*", name) for name, _, _ in names)
    assert ("create_job", "post", "/jobs") in names
    assert ("show_iteration", "get", "/studies/{id}/iterations/{number}") in names


def test_every_field_is_described(document: dict[str, Any]) -> None:
    missing = [name for name, schema in properties(document) if not schema.get("description")]
    assert missing == []


def test_every_plain_field_has_an_example(document: dict[str, Any]) -> None:
    # The example of a problem is a whole document, with all parts it refers to.
    whole = {
        name for name, schema in document["components"]["schemas"].items() if "examples" in schema
    }
    parts = whole.union(
        *(named(document["components"]["schemas"][name], document) for name in whole)
    )
    missing = [
        name
        for name, schema in properties(document)
        if "examples" not in schema
        and not is_composite(schema)
        and name.partition(".")[0] not in parts
    ]
    assert missing == []


def test_every_number_has_its_unit(document: dict[str, Any]) -> None:
    # a parameter of a robot and a figure of a tool have a field with their unit
    own = ("Parameter.value", "ToolFigure.value")
    missing = [
        name
        for name, schema in properties(document)
        if is_number(schema) and "x-unit" not in schema and name not in own
    ]
    assert missing == []


def test_examples_are_valid(document: dict[str, Any]) -> None:
    components = {"components": document["components"]}
    # One schema of all: a schema for each would take minutes to compile.
    named_schemas = dict(properties(document)) | document["components"]["schemas"]
    validator = jsonschema_rs.validator_for({"properties": named_schemas} | components)
    for name, schema in named_schemas.items():
        for example in schema.get("examples", []):
            assert validator.is_valid({name: example}), (name, example)
    content = document["paths"]["/optimize"]["post"]["requestBody"]["content"]["application/json"]
    for example in content["examples"].values():
        assert jsonschema_rs.is_valid(content["schema"] | components, example["value"])


def test_every_problem_is_documented(document: dict[str, Any]) -> None:
    assert {problem.__name__ for problem in types_of_error()} <= document["components"][
        "schemas"
    ].keys()
    for path in document["paths"].values():
        for operation in path.values():
            for status, response in operation["responses"].items():
                expected = "application/problem+json" if int(status) >= 400 else None
                assert expected in (None, *response.get("content", ()))
                if status == "503":
                    assert "Retry-After" in response["headers"]


def test_what_takes_figures_tells_that_they_may_be_unknown(document: dict[str, Any]) -> None:
    schemas, silent = document["components"]["schemas"], set[str]()
    for path, methods in document["paths"].items():
        post = methods.get("post", {})
        taken = named(post.get("requestBody"), document)
        figures = any("figures" in schemas[name].get("properties", {}) for name in taken)
        if figures and "UnknownFigures" not in named(post["responses"], document):
            silent.add(path)
    # a request of a job gets its problem when its turn comes
    assert silent == {"/jobs"}


def test_no_error_model_of_the_framework_is_left(document: dict[str, Any]) -> None:
    assert "HTTPValidationError" not in repr(document)


@pytest.mark.long
def test_every_deadline_is_the_services() -> None:
    document = create_app(Settings(max_deadline=7.5, max_job_deadline=9.5)).openapi()
    fit = document["components"]["schemas"]["IdentifyRequest"]["properties"].pop("deadline")
    assert (fit["maximum"], fit["default"]) == (9.5, 9.5), "a fit is always a job"
    bodies = {name: schema for name, schema in properties(document) if name.endswith(".deadline")}
    assert bodies.keys() >= {
        f"{kind}Request.deadline" for kind in ("Optimize", "Compare", "Pareto", "Whatif")
    }
    numbers = [
        each
        for schema in bodies.values()
        for each in schema.get("anyOf", [schema])
        if each["type"] == "number"
    ]
    assert len(numbers) == len(bodies)
    assert {number["maximum"] for number in numbers} == {7.5}
    assert {schema.get("default") for schema in bodies.values()} == {
        7.5,
        None,
    }  # null: the service's longest
    parameters = document["paths"]["/studies/{id}/suggest"]["get"]["parameters"]
    (query,) = [parameter["schema"] for parameter in parameters if parameter["name"] == "deadline"]
    assert [option.get("maximum") for option in query["anyOf"]] == [7.5, None]


def test_version_is_the_projects(document: dict[str, Any]) -> None:
    assert document["info"]["version"] == __version__


@pytest.fixture(scope="module")
def short(client: TestClient) -> dict[str, Any]:
    """The document of the page `/docs`."""
    return client.get("/docs/openapi.json").json()


def test_tags_are_in_the_order_of_the_work(short: dict[str, Any]) -> None:
    tags = [tag["name"] for tag in short["tags"]]
    used = [own["tags"] for each in short["paths"].values() for own in each.values()]
    assert tags[:3] == ["robots", "motion", "results"]
    assert [tag for tag, _ in groupby(tag for (tag,) in used)] == tags


def test_every_operation_has_its_page(client: TestClient, document: dict[str, Any]) -> None:
    for operations in document["paths"].values():
        for operation in operations.values():
            assert len(operation["summary"]) <= 60
            page = client.get(f"/{operation['externalDocs']['url']}")
            assert page.status_code == 200 and "<h1" in page.text


def test_the_short_document_has_every_operation_and_field(
    document: dict[str, Any], short: dict[str, Any]
) -> None:
    assert short["openapi"].startswith("3.0")
    assert len(json.dumps(short)) < 0.4 * len(json.dumps(document))
    for path, operations in document["paths"].items():
        assert short["paths"][path].keys() == operations.keys()
        for method, own in operations.items():
            content = own.get("requestBody", {}).get("content", {})
            for media_type, body in content.items():
                shown = short["paths"][path][method]["requestBody"]["content"][media_type]
                name = body["schema"].get("$ref", "").rpartition("/")[2]
                fields = document["components"]["schemas"].get(name, {}).get("properties", {})
                table = shown["schema"].get("description", "")
                assert re.findall(r"^\| `(\w+)`", table, re.M) == [*fields]
                assert len(shown["examples"]) == min(len(body["examples"]), 2)


def test_long_requests_have_their_fields_in_groups(
    document: dict[str, Any], short: dict[str, Any]
) -> None:
    """Every schema written by a person with more fields than fit on a screen has groups."""
    schemas = document["components"]["schemas"]
    grouped = {name for name, own in schemas.items() if "x-group" in str(own)}
    asked = {
        content["schema"].get("$ref", "").rpartition("/")[2]
        for operations in document["paths"].values()
        for own in operations.values()
        for content in own.get("requestBody", {}).get("content", {}).values()
    }
    assert {name for name in asked if len(schemas.get(name, {}).get("properties", ())) > 18} == (
        grouped - {"EvaluateCsvSettings", "FiguresDetail"}  # parameters of a query, and an answer
    )
    for name in grouped:
        groups = [own["x-group"] for own in schemas[name]["properties"].values()]
        assert len([key for key, _ in groupby(groups)]) == len(set(groups)) > 4
        assert max(groups.count(group) for group in groups) <= 10
    body = short["paths"]["/optimize"]["post"]["requestBody"]["content"]["application/json"]
    headings = re.findall(r"^### (.+)$", body["schema"]["description"], re.M)
    assert headings[:4] == ["Task", "Arm", "Tool and payload", "Cell"]
    assert body["schema"]["title"] == "Optimize request"


def test_links_of_the_short_document_lead_somewhere(
    client: TestClient, short: dict[str, Any]
) -> None:
    links = set(re.findall(r"\]\(([^)\s]+)\)", json.dumps(short)))
    assert {"problems/unreachable-pose", "help/reference/fields/#jointtarget"} <= links
    pages = dict[str, str]()
    for link in links:
        page, _, place = link.partition("#")
        if page not in pages:
            answer = client.get(f"/{page}")
            assert answer.status_code == 200, link
            pages[page] = answer.text
        assert not place or f'id="{place}"' in pages[page], link


def test_the_short_document_has_no_words_of_later_versions(short: dict[str, Any]) -> None:
    found, open_ = set[str](), [short["paths"]]
    while open_:
        part = open_.pop()
        if isinstance(part, dict):
            part = {key: own for key, own in part.items() if key not in ("example", "value")}
            found |= part.keys()
            assert not isinstance(part.get("type"), list) and part.get("type") != "null"
            limits = (part.get("exclusiveMinimum"), part.get("exclusiveMaximum"))
            assert all(limit in (None, True) for limit in limits), part
        open_ += part.values() if isinstance(part, dict) else part if isinstance(part, list) else []
    assert found.isdisjoint({"$ref", "$defs", "const", "prefixItems", "propertyNames"})


def test_the_document_has_no_words_that_generators_of_clients_refuse(
    document: dict[str, Any],
) -> None:
    # openapi-generator refuses a document of 3.1 with words of 3.2; openapi-python-client leaves
    # out all endpoints with objects as defaults in their requests, and cannot read alternatives
    # with `const`.
    refused = list[str]()

    def collect(node: Any, path: str) -> None:
        inner = node.items() if isinstance(node, dict) else enumerate(node)
        for name, each in inner:
            default = name == "default" and isinstance(each, dict) and not is_schema(each)
            if default or name in ("const", "itemSchema"):
                refused.append(f"{path}/{name}")
            if isinstance(each, dict | list) and name not in ("examples", "example"):
                collect(each, f"{path}/{name}")

    collect(document["components"]["schemas"], "")
    collect(document["paths"], "")
    assert refused == []
    # The meaning stays: a constant is a choice of one, and the description names the default.
    schemas = document["components"]["schemas"]
    assert schemas["SharedBus"]["properties"]["mode"]["enum"] == ["shared"]
    assert '{"mode": "shared"}' in schemas["OptimizeRequest"]["properties"]["bus"]["description"]


def is_schema(node: dict[str, Any]) -> bool:
    return not {"type", "$ref", "anyOf", "oneOf"}.isdisjoint(node)
