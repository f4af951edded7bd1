import { useState } from "preact/hooks";
import { Button } from "../ui/Button";
import { Errors } from "../ui/Errors";
import { Menu } from "../ui/Menu";
import { Section } from "../ui/Section";
import { tool } from "../picture/drag";
import { extentOf } from "../picture/shapes";
import { OBSTACLES, withObstacle, withoutObstacle } from "../store/edits";
import { join } from "../store/pointer";
import { DEFAULT_MARGIN, likelyUnit, obstaclesListed } from "../store/request";
import { base64 } from "../store/share";
import { changes, edit, request, selected, toast } from "../store/state";
import { figure, words } from "../store/units";
import { ObstacleEditor } from "./ObstacleEditor";

const MOST = 60; // obstacles that are listed
const counted = (count: number) =>
  count ? `${count} obstacle${count > 1 ? "s" : ""}` : "nothing around the arm";

/** What stands around the arm. */
export function SceneList() {
  const obstacles = obstaclesListed(request.value);
  const [open, setOpen] = useState<number | null>(null);
  const [why, setWhy] = useState("");
  const add = (name: keyof typeof OBSTACLES) => {
    const place = {
      position: name === "half_space" ? [0, 0, 0] : [0.5, 0, 0.1],
      rotvec: [0, 0, 0],
    };
    edit(
      withObstacle(
        request.value,
        {
          ...OBSTACLES[name],
          size: name === "box" ? [...OBSTACLES.box.size] : undefined,
          pose: place,
        },
        name === "half_space" ? "table" : `${name} 1`,
      ),
      {},
    );
    setOpen(obstacles.length);
    selected.value = join("scene", "obstacles", obstacles.length);
  };
  const upload = async (file: File | undefined) => {
    const format = file?.name.split(".").at(-1)?.toLowerCase();
    if (!file) return;
    if (!["stl", "obj", "glb"].includes(format ?? ""))
      return setWhy("Choose an STL, OBJ or GLB file.");
    setWhy("");
    const bytes = new Uint8Array(await file.arrayBuffer());
    const extent = await extentOf(format!, bytes).catch(() => null);
    if (!extent)
      return setWhy(`${file.name} contains no triangles in the format ${format!.toUpperCase()}.`);
    const scale = likelyUnit(extent);
    edit(
      withObstacle(
        request.value,
        {
          shape: "mesh_file",
          format,
          data: base64(bytes),
          scale,
          pose: { position: [0.5, 0, 0], rotvec: [0, 0, 0] },
        },
        file.name.replace(/\.\w+$/, "").slice(0, 40),
      ),
      {},
    );
    setOpen(obstacles.length);
    selected.value = join("scene", "obstacles", obstacles.length);
    const sides = extent.map((side) => figure(side * scale * 1000)).join(" × ");
    toast.value = `Read in ${scale < 1 ? "millimetres" : "metres"}: ${sides} mm.`;
  };
  return (
    <Section
      title="Scene"
      id="scene"
      note={counted(obstacles.length)}
      action={
        <Menu label="Add" icon="plus" quiet>
          <Button kind="quiet" onClick={() => add("box")}>
            Box
          </Button>
          <Button kind="quiet" onClick={() => add("cylinder")}>
            Cylinder
          </Button>
          <Button kind="quiet" onClick={() => add("sphere")}>
            Sphere
          </Button>
          <Button kind="quiet" onClick={() => add("half_space")}>
            Table or wall (half space)
          </Button>
          <Button kind="quiet" onClick={() => (tool.value = "box")}>
            Draw a box in the picture
          </Button>
          <label class="button quiet">
            Mesh file …
            <input
              type="file"
              class="unseen"
              accept=".stl,.obj,.glb"
              onChange={(event) => void upload(event.currentTarget.files?.[0])}
            />
          </label>
        </Menu>
      }
    >
      {why && (
        <p class="error" role="alert">
          {why}
        </p>
      )}
      <ul class="obstacles">
        {obstacles.slice(0, MOST).map((obstacle, k) => {
          const pointer = join("scene", "obstacles", k);
          const changed = changes.value.some((each) => each.pointer.startsWith(`${pointer}/`));
          const margin = typeof obstacle.margin === "number" ? obstacle.margin : DEFAULT_MARGIN;
          return (
            <li key={k} class={open === k ? "open" : undefined}>
              <div class="row">
                <button
                  type="button"
                  class="plain"
                  aria-expanded={open === k}
                  onClick={() => {
                    setOpen(open === k ? null : k);
                    selected.value = pointer;
                  }}
                >
                  {String(obstacle.name)}{" "}
                  <small>
                    {words(String(obstacle.shape))}, margin {figure(margin * 1000)} mm
                  </small>
                </button>
                {changed && <small class="was">changed</small>}
                <span class="space" />
                <Button
                  kind="quiet"
                  small
                  icon="trash"
                  label={`Delete ${String(obstacle.name)}`}
                  onClick={() => {
                    setOpen(null);
                    edit(withoutObstacle(request.value, k));
                  }}
                />
              </div>
              {open === k && <ObstacleEditor pointer={pointer} />}
              <Errors under={pointer} />
            </li>
          );
        })}
      </ul>
      {obstacles.length > MOST && <p class="hint">{obstacles.length - MOST} more: see JSON.</p>}
      <Errors under="/scene" except={obstacles.map((_, k) => join("scene", "obstacles", k))} />
    </Section>
  );
}
