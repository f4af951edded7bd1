import { Button } from "../ui/Button";
import { picture } from "../picture/instance";
import { send } from "../store/client";
import { csvOf, save } from "../store/share";
import { answered } from "../store/state";
import { trying } from "../store/trouble";
import { alone } from "../store/alone";
import { standalone } from "./standalone";

const json = (value: unknown) => JSON.stringify(value, null, 1);

/** Files of the answer that are not for a controller. */
export function Others() {
  const shown = answered.value;
  if (!shown) return null;
  const { solution, cycle, asked, robot } = shown;
  const whole = cycle ? { ...cycle, loads: undefined } : solution;
  const files: [string, () => Promise<void> | void, boolean][] = [
    ["Answer (JSON)", () => save("answer.json", json(whole), "application/json"), true],
    ["Samples (CSV)", () => save("motion.csv", csvOf(solution.trajectory), "text/csv"), true],
    [
      "Picture (PNG)",
      async () => save("motion.png", (await picture.value?.picture()) ?? new Blob()),
      true,
    ],
    ["Request (JSON)", () => save("request.json", json(asked), "application/json"), true],
    [
      "Stand-alone page (HTML)",
      async () => save("motion.html", await standalone(shown), "text/html"),
      false,
    ],
    [
      "Robot (URDF)",
      async () =>
        save(`${robot.name}.urdf`, await (await send(`robots/${robot.name}/urdf`, {})).blob()),
      false,
    ],
  ];
  return (
    <div class="others">
      {files
        .filter(
          ([name, , here]) =>
            (here || !alone) &&
            (name !== "Picture (PNG)" || picture.value) &&
            (name !== "Request (JSON)" || asked),
        )
        .map(([name, give]) => (
          <Button key={name} kind="link" onClick={trying(async () => give())}>
            {name}
          </Button>
        ))}
    </div>
  );
}
