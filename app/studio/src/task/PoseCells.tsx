import { NumberCell } from "../ui/NumberCell";
import type { Pointer } from "../store/pointer";

export const HEADS = ["X mm", "Y mm", "Z mm", "RX rad", "RY rad", "RZ rad"];
const NAMES = ["X", "Y", "Z", "RX", "RY", "RZ"];

/** Pointer to one of the six numbers of a pose. */
export const numberAt = (pose: Pointer, index: number): Pointer =>
  index < 3 ? `${pose}/position/${index}` : `${pose}/rotvec/${index - 3}`;

interface Props {
  name: string;
  /** Where the pose is in the request. */
  pointer: Pointer;
  six: number[];
  onNumber: (index: number, value: number, text: string, pointer: Pointer) => void;
  onPaste?: (text: string) => boolean;
}

/** The six numbers of a pose in the pendant's own mixture of units: mm, and RX RY RZ in radians. */
export function PoseCells({ name, pointer, six, onNumber, onPaste }: Props) {
  return (
    <div class="six">
      {NAMES.map((axis, k) => (
        <label key={axis} class="six-cell">
          <span aria-hidden="true">{HEADS[k]}</span>
          <NumberCell
            label={`${name} ${axis}`}
            pointer={numberAt(pointer, k)}
            value={six[k]}
            unit={k < 3 ? "mm" : "rad"}
            onValue={(value, text) => onNumber(k, value, text, numberAt(pointer, k))}
            onPaste={onPaste}
          />
        </label>
      ))}
    </div>
  );
}
