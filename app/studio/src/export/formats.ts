// The formats of the service, and which of them are for the robot at hand.
import { openapi } from "../store/service";
import type { Robot } from "../store/types";

export interface Format {
  name: string;
  title: string;
  about: string;
  /** Why it is not for this robot; null if it is. */
  not: string | null;
  group: "robot" | "software" | "makers";
}

const TITLES: Record<string, [title: string, about: string]> = {
  urscript: [
    "Program, exact motion",
    "Follows the answer by servoj. The energy stated is that of this motion.",
  ],
  rapid: ["RAPID module", "Points that an ABB controller moves through."],
  krl: ["KRL program", "Points that a KUKA controller moves through."],
  franka: ["Franka", "A table or a motion generator for libfranka."],
  ros2: ["ROS 2 trajectory", "A goal for ros2_control, as YAML."],
  moveit: ["MoveIt", "A RobotTrajectory to check in RViz."],
  csv: ["Table, CSV", "Time, joints, speeds: for a spreadsheet."],
  json: ["Splines, JSON", "The curves themselves, for your own code."],
  npz: ["Arrays, NPZ", "The samples for numpy."],
  joint_limits: ["Joint limits", "A joint_limits.yaml that this path and payload can keep."],
  mcap: ["Recording, MCAP", "For Foxglove, PlotJuggler and ros2 bag play."],
};
const MAKERS: Record<string, [RegExp, string]> = {
  urscript: [/^Universal Robots/, "Universal Robots"],
  franka: [/^Franka/, "Franka"],
  krl: [/^KUKA/, "KUKA"],
  rapid: [/^ABB/, "ABB"],
};

/** Formats of which a text can be looked at. */
export const isText = (name: string) => !["npz", "mcap"].includes(name);

/** All formats of the service, for a robot. Throws Problem. */
export async function formatsFor(robot: Robot): Promise<Format[]> {
  const { paths, components } = await openapi();
  const parameter = paths["/export/{format}"]?.post?.parameters?.find(
    ({ name }) => name === "format",
  );
  const reference = parameter?.schema.$ref as string | undefined;
  const schema = reference ? components.schemas[reference.split("/").at(-1)!] : parameter?.schema;
  return ((schema?.enum ?? []) as string[]).map((name): Format => {
    const [title, about] = TITLES[name] ?? [name, ""];
    const maker = MAKERS[name];
    const fits = !maker || maker[0].test(robot.title);
    return {
      name,
      title,
      about,
      not: fits ? null : `Not for a ${robot.title}.`,
      group: fits ? (maker ? "robot" : "software") : "makers",
    };
  });
}
