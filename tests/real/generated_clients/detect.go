// Sends a frame with the generated client: `detect ADDRESS IMAGE`. Prints the number of persons.
package main

import (
	"context"
	"fmt"
	"log"
	"os"

	client "github.com/GIT_USER_ID/GIT_REPO_ID"
)

func main() {
	frame, err := os.Open(os.Args[2])
	if err != nil {
		log.Fatal(err)
	}
	configuration := client.NewConfiguration()
	configuration.Servers = client.ServerConfigurations{{URL: os.Args[1]}}
	api := client.NewAPIClient(configuration).DetectionAPI
	request := api.DetectPersons(context.Background()).Img(frame).Calibration("office").Profile(client.FAST)
	report, _, err := request.Execute()
	if err != nil {
		log.Fatal(err)
	}
	fmt.Println(len(report.Persons))
}
