import { Button } from "../ui/Button";
import { Menu } from "../ui/Menu";
import { alone } from "../store/alone";
import { BASE } from "../store/placement";
import { obstaclesListed, rowsOf } from "../store/request";
import { placing, request, selected, show } from "../store/state";
import { tool, type Tool } from "./drag";
import { picture } from "./instance";

const SHOWN: [keyof typeof show.value, string][] = [
  ["ghosts", "start and goal"],
  ["path", "path of the TCP"],
  ["nearest", "nearest pair"],
  ["margins", "margins of obstacles"],
  ["capsules", "bodies of the collision check"],
  ["axes", "base frame"],
  ["fade", "fade bodies that hide the arm"],
];
const VIEWS = ["Clearest", "From −y", "From x", "From −x", "From y", "From above"];

/** What can be done in the picture, and what it shows. */
export function Tools() {
  return (
    <>
      {!alone && <DragTools />}
      <div class="tools right" role="toolbar" aria-label="View">
        <Menu label="View" quiet>
          {VIEWS.map((name, k) => (
            <Button key={name} kind="quiet" onClick={() => picture.value?.look(k + 1)}>
              {k + 1} {name}
            </Button>
          ))}
        </Menu>
        <Menu label="Show" quiet id="show">
          {SHOWN.map(([name, text]) => (
            <label key={name}>
              <input
                type="checkbox"
                data-show={name}
                checked={show.value[name]}
                onChange={(event) =>
                  (show.value = { ...show.value, [name]: event.currentTarget.checked })
                }
              />{" "}
              {text}
            </label>
          ))}
        </Menu>
      </div>
    </>
  );
}

function DragTools() {
  const rows = rowsOf(request.value);
  const pick = (next: Tool) => {
    if (next !== "box" && !selected.value) selected.value = rows.at(-1)?.pointer ?? null;
    tool.value = tool.value === next ? "look" : next;
  };
  const names = [
    ...(placing.value ? [[BASE, "robot base"] as const] : []),
    ...rows.map(({ pointer, name }) => [pointer, name] as const),
    ...obstaclesListed(request.value).map(
      ({ name }, k) => [`/scene/obstacles/${k}`, String(name)] as const,
    ),
  ];
  const dragging = tool.value === "move" || tool.value === "turn";
  return (
    <div class="tools" role="toolbar" aria-label="Editing in the picture">
      <Button
        kind="quiet"
        small
        icon="move"
        pressed={tool.value === "move"}
        onClick={() => pick("move")}
      >
        Drag
      </Button>
      <Button
        kind="quiet"
        small
        icon="turn"
        pressed={tool.value === "turn"}
        onClick={() => pick("turn")}
      >
        Turn
      </Button>
      {dragging && (
        <select
          id="drag"
          aria-label="Object to drag"
          value={selected.value ?? ""}
          onChange={(event) => (selected.value = event.currentTarget.value)}
        >
          {names.map(([pointer, name]) => (
            <option key={pointer} value={pointer}>
              {name}
            </option>
          ))}
        </select>
      )}
      <Button
        kind="quiet"
        small
        icon="box"
        id="draw-box"
        pressed={tool.value === "box"}
        onClick={() => pick("box")}
      >
        Add box
      </Button>
    </div>
  );
}
