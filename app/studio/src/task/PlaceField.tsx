import { Button } from "../ui/Button";
import { Section } from "../ui/Section";
import { placing, tab } from "../store/state";

/** The way to the search for a place of the robot. */
export function PlaceField() {
  const open = () => {
    placing.value = true;
    tab.value = "answer";
  };
  return (
    <Section title="Place of the robot" id="place">
      <Button id="place-robot" disabled={placing.value} onClick={open}>
        Where to put the robot …
      </Button>
    </Section>
  );
}
